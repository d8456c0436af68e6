// SPDX-License-Identifier: Apache-2.0
#include "farm/merge_job.h"

#include "base/atomic_file.h"
#include "base/json_depth.h"
#include "base/json_numbers.h"
#include "base/output_lock.h"
#include "farm/preview.h"
#include "farm/process.h"
#include "farm/run_piece.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <map>
#include <utility>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

using json = nlohmann::ordered_json;

constexpr const char* frame_schema = "velatura.farm.frame/1";

/// The settings that a part states, by name.
json settings_of(const std::string& file) {
    const auto reader = image::ExrReader::open(file);
    if (!reader) return {};
    const auto header = layers::read_layer_header(reader->header());
    if (!header) return {};
    const auto info = layers::file_info_of(reader->header(), *header);
    const json all = json::parse(info.settings_json, nullptr, false);
    return all.is_object() ? all.value("settings", json::object()) : json();
}

/// "plugins openimageio and none": which settings differ, in the order of the first.
std::string differences(const json& a, const json& b) {
    std::string text;
    if (!a.is_object() || !b.is_object()) return text;
    for (const auto& [name, value] : a.items())
        if (b.value(name, json()) != value)
            text += fmt::format("{}{} {} and {}", text.empty() ? "" : ", ", name, value.dump(),
                                b.value(name, json()).dump());
    return text;
}

/// Fails the pieces whose parts have another scene or other settings than the others: those of the
/// smaller number.
void find_strangers(const Job& job,
                    const std::vector<size_t>& pieces,
                    const std::vector<PieceState>& states,
                    std::map<size_t, std::string>& problems) {
    const auto key_of = [&](size_t i) { return states[i].part->scene + states[i].part->settings; };
    std::map<std::string, size_t> counts;
    for (size_t i = 0; i < pieces.size(); ++i) ++counts[key_of(i)];
    if (counts.size() < 2) return;
    size_t usual = 0;
    for (size_t i = 1; i < pieces.size(); ++i)
        if (counts[key_of(i)] > counts[key_of(usual)]) usual = i;
    const json settings = settings_of(job.part_file(pieces[usual]));
    for (size_t i = 0; i < pieces.size(); ++i) {
        if (key_of(i) == key_of(usual)) continue;
        const std::string what = states[i].part->scene != states[usual].part->scene
                                     ? "files of the scene differ"
                                     : differences(settings, settings_of(job.part_file(pieces[i])));
        problems[pieces[i]] = fmt::format(
            "its part is of another scene or other settings than piece {} on {}: {}", pieces[usual],
            states[usual].attempts.back().node, what.empty() ? "settings hash" : what);
    }
}

/// The pieces of a frame that must be rendered again, with the reason.
std::map<size_t, std::string> problems_of(const Job& job,
                                          const std::vector<size_t>& pieces,
                                          const std::vector<PieceState>& states) {
    std::map<size_t, std::string> problems;
    for (size_t i = 0; i < pieces.size(); ++i)
        if (const std::string why = problem_of_part(job, pieces[i], states[i]); !why.empty())
            problems[pieces[i]] = why;
    if (problems.empty()) find_strangers(job, pieces, states, problems);
    return problems;
}

json to_json(const std::vector<ErrorAt>& errors) {
    json list = json::array();
    for (const ErrorAt& e : errors)
        list.push_back({{"spp", e.spp},
                        {"error", e.error},
                        {"is_lower", e.is_lower},
                        {"low", e.low},
                        {"high", e.high}});
    return list;
}

/// Throws std::exception.
std::vector<ErrorAt> errors_from(const json& list) {
    std::vector<ErrorAt> errors;
    for (const json& e : list)
        errors.push_back({whole_number<uint64_t>(e.at("spp")), e.at("error").get<double>(),
                          e.at("is_lower").get<bool>(), e.value("low", 0.0), e.value("high", 0.0)});
    return errors;
}

/// The error of the mix of the job's preset, as `velatura-comp noise` predicts it from the halves.
/// `why`: the error line of that program, where it has one.
std::optional<ErrorAt> error_of_mix(const Job& job, size_t frame, uint64_t spp, std::string& why) {
    std::string printed;
    ProcessRequest request;
    request.arguments = {compositor_program(), "noise", job.outputs[frame],
                         "--preset",           job.mix, "--json"};
    request.log = job.path(fmt::format("logs/merge.{:04}.log", frame));
    request.on_line = [&](std::string_view line) {
        // Warnings stand before the object and behind it
        const bool is_inside = !printed.empty() && !printed.ends_with("\n}\n");
        if (line == "{" || is_inside) printed += std::string(line) + "\n";
        if (why.empty() && line.starts_with("error: ")) why = line;
    };
    const Result<ProcessResult> ended = run_process(request);
    if (!ended || ended->code != 0) return std::nullopt;
    const json report = json::parse(printed, nullptr, false);
    const json mix = report.is_object() ? report.value("mix", json()) : json();
    const json value = mix.is_object() ? mix.value("value", json()) : json();
    if (!value.is_number()) return std::nullopt;
    return ErrorAt{spp, value.get<double>(), mix.value("isLower", false), mix.value("low", 0.0),
                   mix.value("high", 0.0)};
}

Result<FrameResult> merge(const Job& job, size_t frame, const std::vector<size_t>& pieces) {
    const auto earlier = stored_result(job, frame);
    if (!earlier) return earlier.error();
    FrameResult result;
    result.output = job.outputs[frame];
    result.spp = job.spp_of(frame);
    if (*earlier) result.errors = (*earlier)->errors;
    std::erase_if(result.errors, [&](const ErrorAt& e) { return e.spp >= result.spp; });
    std::string printed;
    ProcessRequest request;
    request.arguments = {compositor_program(), "merge"};
    for (const size_t piece : pieces) request.arguments.push_back(job.part_file(piece));
    request.arguments.insert(request.arguments.end(), {"-o", result.output});
    request.log = job.path(fmt::format("logs/merge.{:04}.log", frame));
    request.on_line = [&](std::string_view line) {
        constexpr size_t digits = 64;
        if (line.size() > digits && line[digits] == ' ') result.sha256 = line.substr(0, digits);
        if (line.find("error: ") != std::string_view::npos) printed = line;
    };
    const Result<ProcessResult> ended = run_process(request);
    if (!ended) return ended.error();
    if (ended->code == 0) printed.clear();
    result.wall_s = ended->wall_s;
    if (ended->code != 0)
        result.problem = fmt::format("the merge of {} ended with exit code {}{}", result.output,
                                     ended->code, printed.empty() ? "" : ": " + printed);
    else if (const auto error = job.mix.empty() ? stated_error(result.output, result.spp)
                                                : error_of_mix(job, frame, result.spp, printed))
        result.errors.push_back(*error);
    else if (job.target_error > 0)
        result.problem =
            fmt::format("the error of {} is not known at {} samples per pixel{}", result.output,
                        result.spp, printed.empty() ? "" : ": " + printed);
    if (const auto ok = write_result(job, frame, result); !ok) return ok.error();
    if (ended->code != 0) return Error{"farm-merge", result.problem};
    finish_preview(job, frame);
    return result;
}

}  // namespace

std::optional<ErrorAt> stated_error(const std::string& file, uint64_t spp) {
    const auto reader = image::ExrReader::open(file);
    if (!reader) return std::nullopt;
    const auto header = layers::read_layer_header(reader->header());
    if (!header) return std::nullopt;
    const std::string stats = layers::file_info_of(reader->header(), *header).stats_json;
    const json error = json::parse(stats, nullptr, false).value("error", json::object());
    const json mean = error.value("mean", json());
    if (!mean.is_number()) return std::nullopt;
    return ErrorAt{spp, mean.get<double>(), error.value("is_lower", false), error.value("low", 0.0),
                   error.value("high", 0.0)};
}

Result<std::optional<FrameResult>> stored_result(const Job& job, size_t frame) {
    std::error_code error;
    if (!fs::exists(job.result_file(frame), error)) return std::optional<FrameResult>();
    const Result<std::string> text = read_file(job.result_file(frame));
    if (!text) return text.error();
    const Error damaged = {"farm-piece", fmt::format("{} is damaged; remove it to merge the frame "
                                                     "again",
                                                     job.result_file(frame))};
    const json j = is_json_too_deep(*text) ? json() : json::parse(*text, nullptr, false);
    if (!j.is_object() || j.value("schema", json()) != frame_schema) return damaged;
    try {
        FrameResult result;
        result.output = j.at("output").get<std::string>();
        result.sha256 = j.at("sha256").get<std::string>();
        result.wall_s = j.at("wall_s").get<double>();
        result.spp = whole_number<uint64_t>(j.at("spp"));
        result.errors = errors_from(j.at("errors"));
        result.problem = j.value("problem", "");
        result.limit = j.value("limit", "");
        return std::optional(std::move(result));
    } catch (const std::exception&) {
        return damaged;
    }
}

Result<void> write_result(const Job& job, size_t frame, const FrameResult& result) {
    json j = {{"schema", frame_schema},  {"output", result.output},
              {"sha256", result.sha256}, {"wall_s", result.wall_s},
              {"spp", result.spp},       {"errors", to_json(result.errors)}};
    if (!result.problem.empty()) j["problem"] = result.problem;
    if (!result.limit.empty()) j["limit"] = result.limit;
    return write_file_atomically(job.result_file(frame),
                                 j.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

Result<std::optional<FrameResult>> read_result(const Job& job, size_t frame) {
    Result<std::optional<FrameResult>> result = stored_result(job, frame);
    if (!result || !*result) return result;
    std::error_code error;
    const FrameResult& r = **result;
    if (r.spp != job.spp_of(frame) || (r.problem.empty() && !fs::exists(r.output, error)))
        return std::optional<FrameResult>();
    return result;
}

Result<std::optional<FrameResult>> merge_frame(const Job& job, size_t frame) {
    const std::vector<size_t> pieces = job.pieces_of(frame);
    if (job.spp_of(frame) < job.spp) return std::optional<FrameResult>();
    std::vector<PieceState> states;
    for (const size_t piece : pieces) {
        Result<PieceState> state = read_piece(job, piece);
        if (!state) return state.error();
        if (state->state != State::Done) return std::optional<FrameResult>();
        states.push_back(std::move(*state));
    }
    const std::map<size_t, std::string> problems = problems_of(job, pieces, states);
    for (size_t i = 0; i < pieces.size(); ++i) {
        const auto problem = problems.find(pieces[i]);
        if (problem == problems.end()) continue;
        std::error_code ignored;
        fs::remove(job.part_file(pieces[i]), ignored);
        note_failure(states[i], job, problem->second, false);
        if (const auto ok = write_piece(job, pieces[i], states[i]); !ok) return ok.error();
    }
    if (!problems.empty()) return std::optional<FrameResult>();
    Result<FrameResult> merged = merge(job, frame, pieces);
    if (!merged) return merged.error();
    return std::optional(std::move(*merged));
}

void merge_finished_frame(const Job& job, size_t frame) {
    if (job.frames.size() < 2) return;
    for (const size_t piece : job.pieces_of(frame)) {
        const auto state = read_piece(job, piece);
        if (!state || state->state != State::Done) return;
    }
    const Result<OutputLock> lock = OutputLock::take(job.result_file(frame));
    if (!lock) return;
    const auto known = read_result(job, frame);
    if (known && !*known) (void)merge_frame(job, frame);
}

Result<void> merge_frames(const Job& job) {
    Result<void> all;
    for (size_t frame = 0; frame < job.frames.size(); ++frame) {
        const auto known = read_result(job, frame);
        if (!known) return known.error();
        if (*known && (*known)->problem.empty()) continue;
        const auto merged = merge_frame(job, frame);
        if (!merged && all) all = merged.error();
    }
    return all;
}

}  // namespace velatura::farm
