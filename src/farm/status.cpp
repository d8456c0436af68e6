// SPDX-License-Identifier: Apache-2.0
#include "farm/status.h"

#include "base/frames.h"
#include "base/output_lock.h"
#include "farm/merge_job.h"
#include "farm/rounds.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string_view>

namespace velatura::farm {

namespace {

using json = nlohmann::ordered_json;

constexpr std::string_view job_state_names[] = {"waiting", "running", "complete", "incomplete",
                                                "canceled"};

std::string duration(double s) {
    if (s < 60) return fmt::format("{:.1f} s", s);
    if (s < 3600) return fmt::format("{} min {:02} s", int(s) / 60, int(s) % 60);
    return fmt::format("{:.2f} h", s / 3600);
}

double cpu_hours(const JobStatus& s) {
    return s.cpu_s / 3600;
}

/// Of the last attempt; of one that runs so far.
double wall_of(const PieceState& s) {
    if (s.attempts.empty()) return 0;
    const Attempt& a = s.attempts.back();
    return s.state == State::Running ? std::max(0.0, now_s() - a.start_s) : a.wall_s;
}

/// Samples of a piece that it has so far.
double samples_of(const Piece& p, const PieceState& s) {
    return double(p.end - p.first) * (s.state == State::Done ? 1 : s.percent / 100);
}

/// Samples of each pixel in a minute, of pieces that run or are done in one start.
std::string rate_of(const Piece& p, const PieceState& s) {
    const double wall_s = wall_of(s);
    const bool is_known = s.attempts.size() == 1 && wall_s > 0 && samples_of(p, s) > 0;
    return is_known ? fmt::format("{:.3g}", 60 * samples_of(p, s) / wall_s) : "";
}

std::string table(const Job& job, const JobStatus& status, bool all) {
    std::string rows;
    size_t hidden = 0;
    for (size_t i = 0; i < status.pieces.size(); ++i) {
        const PieceState& s = status.pieces[i];
        const bool is_quiet = s.state == State::Done || s.state == State::Canceled ||
                              (s.state == State::Waiting && s.attempts.empty());
        if (!all && is_quiet) {
            ++hidden;
            continue;
        }
        const Piece& p = job.pieces[i];
        rows += fmt::format("{:>6} {:>8} {:>15} {:<9} {:<16} {:>3} {:>6} {:>8} {:>11}  {}\n", i,
                            job.frames[p.frame].empty() ? "-" : job.frames[p.frame],
                            fmt::format("{}:{}", p.first, p.end), name_of(s.state),
                            s.attempts.empty() ? "-" : s.attempts.back().node, s.attempts.size(),
                            s.state == State::Running ? fmt::format("{:.0f} %", s.percent) : "",
                            rate_of(p, s), s.attempts.empty() ? "" : duration(wall_of(s)),
                            s.attempts.empty() ? "" : s.attempts.back().reason);
    }
    if (rows.empty()) return {};
    return fmt::format("{:>6} {:>8} {:>15} {:<9} {:<16} {:>3} {:>6} {:>8} {:>11}  {}\n", "piece",
                       "frame", "samples", "state", "node", "try", "done", "spp/min", "time",
                       "reason") +
           rows;
}

/// Whether a process of this machine runs the pieces of a local job, or merges them.
bool is_run_here(const Job& job) {
    const Result<OutputLock> lock = OutputLock::take(job.path("job.json"));
    return !lock && lock.error().code == "output-locked";
}

/// Of the image, or of the interim one if it has more samples.
std::optional<ErrorAt> current_error(const JobStatus& status, size_t frame) {
    const std::optional<ErrorAt>& of_image = status.errors[frame];
    const std::optional<Preview>& preview = status.previews[frame];
    if (!preview || !preview->error) return of_image;
    return of_image && of_image->spp >= preview->error->spp ? of_image : preview->error;
}

/// Error and target; of several frames the largest error. Empty: not known.
std::string error_text(const Job& job, const JobStatus& status) {
    std::optional<ErrorAt> worst;
    for (size_t i = 0; i < status.errors.size(); ++i) {
        const std::optional<ErrorAt> e = current_error(status, i);
        if (e && (!worst || e->error > worst->error)) worst = e;
    }
    if (!worst) return {};
    std::string text = fmt::format("{}error {}{:.3g} %", job.frames.size() > 1 ? "largest " : "",
                                   worst->is_lower ? "at least " : "", 100 * worst->error);
    if (job.target_error > 0) text += fmt::format(", target {:.3g} %", 100 * job.target_error);
    return text + fmt::format(", at {} samples per pixel\n", worst->spp);
}

}  // namespace

std::string_view name_of(JobState state) {
    return job_state_names[size_t(state)];
}

size_t JobStatus::merged_count() const {
    return size_t(std::count(is_merged.begin(), is_merged.end(), true));
}

Result<JobStatus> status_of(const Job& job) {
    JobStatus status;
    Result<std::vector<PieceState>> pieces = read_pieces(job);
    if (!pieces) return pieces.error();
    status.pieces = std::move(*pieces);
    double first_s = 0, last_s = 0, done_s = 0, done_samples = 0, open = 0;
    std::vector<uint64_t> spp(job.frames.size());
    for (size_t i = 0; i < status.pieces.size(); ++i) {
        const PieceState& s = status.pieces[i];
        const Piece& p = job.pieces[i];
        spp[p.frame] = std::max(spp[p.frame], p.end);
        ++status.counts[size_t(s.state)];
        for (const Attempt& a : s.attempts) {
            status.cpu_s += a.cpu_s;
            first_s = first_s == 0 ? a.start_s : std::min(first_s, a.start_s);
            last_s = std::max(last_s, a.start_s + a.wall_s);
        }
        status.samples_done += samples_of(p, s);
        if (s.state == State::Done) {
            done_s += s.attempts.back().wall_s;
            done_samples += double(p.end - p.first);
        } else if (s.state != State::GaveUp) {
            open += double(p.end - p.first) - samples_of(p, s);
        }
    }
    for (size_t frame = 0; frame < job.frames.size(); ++frame) {
        // Samples that are not split into pieces yet
        const uint64_t whole = std::max(spp[frame], job.spp);
        status.samples_wanted += double(whole);
        open += double(whole - spp[frame]);
        const auto result = read_result(job, frame);
        if (!result) return result.error();
        const bool has_failed = *result && !(*result)->problem.empty();
        if (has_failed) status.problems.push_back((*result)->problem);
        status.is_merged.push_back(*result && !has_failed && !needs_samples(job, **result));
        std::optional<ErrorAt> error;
        if (*result && (*result)->has_error()) {
            error = (*result)->errors.back();
            status.stated.push_back(error->error);
            error->error = error_by_rounds((*result)->errors);
        } else {
            status.stated.push_back(0);
        }
        status.errors.push_back(error);
        status.limits.push_back(*result ? (*result)->limit : "");
        status.previews.push_back(
            job.has_previews && !status.is_merged.back() ? read_preview(job, frame) : std::nullopt);
    }
    const size_t done = status.count(State::Done), running = status.count(State::Running);
    bool can_go_on = false;
    const bool has_ended = status.count(State::GaveUp) + status.problems.size() > 0 &&
                           done + status.count(State::GaveUp) == job.pieces.size();
    if (has_ended) {
        const Result<bool> lacks = lacks_pieces(job, status.pieces);
        if (!lacks) return lacks.error();
        can_go_on = *lacks;
    }
    if (status.merged_count() == job.frames.size())
        status.state = JobState::Complete;
    else if (is_canceled(job))
        status.state = JobState::Canceled;
    else if (status.count(State::Waiting) == job.pieces.size() && first_s == 0)
        status.state = JobState::Waiting;
    else if (job.engine == Engine::Local && running == 0 && !is_run_here(job))
        status.state = JobState::Incomplete;  // `farm submit` runs the pieces itself, and ended
    else if (has_ended && !can_go_on)
        status.state = JobState::Incomplete;
    else
        status.state = JobState::Running;
    if (first_s > 0) status.wall_s = (running > 0 ? std::max(now_s(), last_s) : last_s) - first_s;
    if (running > 0 && done_samples > 0)
        status.left_s = done_s / done_samples * open / double(running);
    return status;
}

std::string status_text(const Job& job, const JobStatus& status, bool all, double price) {
    std::string text = fmt::format("{}: {}, {} of {} pieces done", job.name, name_of(status.state),
                                   status.count(State::Done), job.pieces.size());
    for (const State s : {State::Running, State::Lost, State::Failed, State::GaveUp})
        if (status.count(s) > 0) text += fmt::format(", {} {}", status.count(s), name_of(s));
    text += fmt::format("; {} of {} frame{} written\n", status.merged_count(), job.frames.size(),
                        job.frames.size() == 1 ? "" : "s");
    if (status.samples_done > 0 && status.samples_done < status.samples_wanted)
        text += fmt::format("{:.0f} of {:.0f} samples per pixel{}\n", status.samples_done,
                            status.samples_wanted, job.frames.size() > 1 ? " of all frames" : "");
    if (status.cpu_s > 0 || status.wall_s > 0) {
        text += fmt::format("{} since the first start, {:.3f} CPU hours", duration(status.wall_s),
                            cpu_hours(status));
        if (price > 0) text += fmt::format(", cost {:.2f}", price * cpu_hours(status));
        if (status.left_s) text += fmt::format(", about {} left", duration(*status.left_s));
        text += "\n";
    }
    text += error_text(job, status);
    text += table(job, status, all);
    if (status.state == JobState::Incomplete || status.state == JobState::Canceled)
        text += incomplete_text(job, status);
    return text;
}

std::string status_json(const Job& job, const JobStatus& status, double price) {
    json j;
    j["schema"] = "velatura.farm.status/1";
    j["job"] = job.folder;
    j["name"] = job.name;
    j["engine"] = name_of(job.engine);
    j["state"] = name_of(status.state);
    j["pieces"] = {{"total", job.pieces.size()}};
    for (size_t s = 0; s < status.counts.size(); ++s)
        j["pieces"][std::string(name_of(State(s)))] = status.counts[s];
    j["frames"] = {{"total", job.frames.size()}, {"written", status.merged_count()}};
    j["wall_s"] = status.wall_s;
    j["cpu_s"] = status.cpu_s;
    j["left_s"] = status.left_s ? json(*status.left_s) : json(nullptr);
    j["samples"] = {{"done", status.samples_done}, {"wanted", status.samples_wanted}};
    if (price > 0) j["cost"] = price * cpu_hours(status);
    if (job.target_error > 0) j["target_error"] = job.target_error;
    j["outputs"] = json::array();
    for (size_t i = 0; i < job.frames.size(); ++i) {
        json row = {{"frame", job.frames[i]},
                    {"file", job.outputs[i]},
                    {"written", bool(status.is_merged[i])}};
        if (const std::optional<ErrorAt>& e = status.errors[i])
            row.update({{"spp", e->spp},
                        {"error", e->error},
                        {"is_lower", e->is_lower},
                        {"stated", status.stated[i]}});
        if (!status.limits[i].empty()) row["limit"] = status.limits[i];
        if (const std::optional<Preview>& p = status.previews[i]) {
            row["preview"] = {{"file", job.preview_file(i, ".exr")},
                              {"samples", {p->first, p->end}}};
            if (p->has_png) row["preview"]["png"] = job.preview_file(i, ".png");
            if (p->error)
                row["preview"].update(
                    {{"error", p->error->error}, {"is_lower", p->error->is_lower}});
        }
        j["outputs"].push_back(std::move(row));
    }
    j["list"] = json::array();
    for (size_t i = 0; i < status.pieces.size(); ++i) {
        const PieceState& s = status.pieces[i];
        const Piece& p = job.pieces[i];
        json row = {{"piece", i},
                    {"frame", job.frames[p.frame]},
                    {"samples", {p.first, p.end}},
                    {"state", name_of(s.state)},
                    {"attempts", s.attempts.size()},
                    {"failures", s.failures}};
        if (s.state == State::Running) row["percent"] = s.percent;
        if (!s.attempts.empty()) {
            const Attempt& a = s.attempts.back();
            row["node"] = a.node;
            row["wall_s"] = wall_of(s);
            row["cpu_s"] = a.cpu_s;
            row["peak_bytes"] = a.peak_bytes;
            row["code"] = a.code;
            row["reason"] = a.reason;
            row["log"] = a.log;
        }
        j["list"].push_back(std::move(row));
    }
    return j.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string incomplete_text(const Job& job, const JobStatus& status) {
    std::vector<int> missing;
    std::string text;
    for (size_t i = 0; i < status.pieces.size(); ++i) {
        const PieceState& s = status.pieces[i];
        if (s.state == State::Done) continue;
        missing.push_back(int(i));
        constexpr size_t max_listed = 20;
        if (missing.size() > max_listed || s.attempts.empty()) continue;
        const Attempt& a = s.attempts.back();
        text += fmt::format("  {} on {}: {}; log: {}\n", job.title(i), a.node,
                            a.reason.empty() ? "did not end" : a.reason, job.path(a.log));
    }
    for (const std::string& problem : status.problems) text += fmt::format("  {}\n", problem);
    if (missing.empty() && status.samples_done < status.samples_wanted)
        return fmt::format("{}to render the other samples: velatura farm retry {}\n", text,
                           job.folder);
    if (missing.empty())
        return fmt::format("{}to merge: velatura farm retry {}\n", text, job.folder);
    return fmt::format("missing: pieces {}\n{}to render them: velatura farm retry {}\n",
                       frame_list(missing), text, job.folder);
}

}  // namespace velatura::farm
