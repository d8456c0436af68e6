// SPDX-License-Identifier: Apache-2.0
#include "farm/run_piece.h"

#include "base/atomic_file.h"
#include "farm/process.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::farm {

namespace fs = std::filesystem;

namespace {

// Exit codes of `velatura render` (docs/reference/command_line.md) that another try repeats
constexpr int usage = 2, check_failed = 4, refused = 5;

std::string environment(const char* name) {
    const char* const value = std::getenv(name);
    return value ? value : "";
}

/// Threads that the engine gave to this task; 0: it says nothing.
int threads_of_engine() {
    for (const char* name : {"SLURM_CPUS_PER_TASK", "CUE_THREADS"})
        if (const int count = std::atoi(environment(name).c_str()); count > 0) return count;
    return 0;
}

bool has_option(const Job& job, std::string_view name) {
    return std::any_of(job.options.begin(), job.options.end(), [&](const std::string& word) {
        return word == name || (word.starts_with(name) && word[name.size()] == '=');
    });
}

/// Whether the job gives an option this value, as "--name=value" or as two words.
bool has_value(const Job& job, const std::string& name, std::string_view value) {
    for (size_t i = 0; i < job.options.size(); ++i)
        if (job.options[i] == fmt::format("{}={}", name, value) ||
            (job.options[i] == name && i + 1 < job.options.size() && job.options[i + 1] == value))
            return true;
    return false;
}

/// The part that holds the first samples of a frame, with the rates that adaptive sampling found
/// there; empty while it is not done, or where it has none. Others then trace no pilot samples.
std::string rates_part(const Job& job, size_t index) {
    const std::vector<size_t> pieces = job.pieces_of(job.pieces[index].frame);
    const size_t first = pieces.front();
    if (first == index || job.pieces[first].end <= pilot_samples) return {};
    if (has_value(job, "--adaptive", "off")) return {};
    const Result<PieceState> state = read_piece(job, first);
    const bool is_there =
        state && state->state == State::Done && problem_of_part(job, first, *state).empty();
    return is_there ? job.part_file(first) : std::string();
}

std::string stats_file(const Job& job, size_t index) {
    return job.path(fmt::format("work/{:04}.json", index));
}

std::vector<std::string> command_of(const Job& job, size_t index, const RunOptions& options) {
    const Piece& piece = job.pieces[index];
    std::vector<std::string> words = {job.program, "render", job.scene};
    words.insert(words.end(), job.options.begin(), job.options.end());
    if (!job.frames[piece.frame].empty()) words.push_back("--frames=" + job.frames[piece.frame]);
    if (!job.checkpoint.empty()) words.push_back("--checkpoint=" + job.checkpoint);
    const int threads = options.threads > 0 ? options.threads : threads_of_engine();
    if (threads > 0 && !has_option(job, "--threads"))
        words.push_back(fmt::format("--threads={}", threads));
    if (const std::string rates = rates_part(job, index); !rates.empty())
        words.push_back("--rates-from=" + rates);
    // The image of a piece is not kept: deflate would take longer than it saves
    if (!has_option(job, "--exr-compression")) words.emplace_back("--exr-compression=rle");
    // A node that lacks a file is to say so at once, not after hours
    if (!has_value(job, "--missing-assets", "ignore") && !has_option(job, "--require-assets"))
        words.emplace_back("--require-assets");
    for (std::string word :
         {fmt::format("--samples={}:{}", piece.first, piece.end),
          "--output=" + job.work_file(index), "--stats=" + stats_file(job, index),
          std::string("--resume"), std::string("--progress=json")})
        words.push_back(std::move(word));
    return words;
}

/// Wall time of the samples in the statistics of a render; 0: they do not say so.
double trace_time(const std::string& file) {
    const Result<std::string> text = read_file(file);
    if (!text) return 0;
    const auto j = nlohmann::json::parse(*text, nullptr, false);
    if (!j.is_object() || !j.contains("phases_s") || !j["phases_s"].is_object()) return 0;
    const auto render = j["phases_s"].value("render", nlohmann::json());
    return render.is_number() ? render.get<double>() : 0;
}

/// The percentage of a line of --progress json; below 0: another line.
double percent_of(std::string_view line) {
    if (!line.starts_with("{\"percent\"")) return -1;
    const auto j = nlohmann::json::parse(line, nullptr, false);
    if (!j.is_object()) return -1;
    const auto percent = j.find("percent");
    return percent != j.end() && percent->is_number() ? percent->get<double>() : -1;
}

/// One start of a piece, from the state before it to the one after.
class Run {
  public:
    Run(const Job& job, size_t index, const RunOptions& options, PieceState state)
        : job_(job), index_(index), options_(options), state_(std::move(state)) {}

    Result<PieceState> run() {
        begin();
        if (const Result<void> ok = write(); !ok) return ok.error();
        if (state_.state == State::GaveUp) return state_;
        if (options_.build != job_.build)
            return fail(fmt::format("this machine has build {}, the job was submitted with {}",
                                    options_.build, job_.build),
                        refused, true);
        Result<ProcessResult> ended = render();
        if (ended && ended->code == refused && is_resume_refused_ && !is_stopped_) {
            // Left by another build, or cut by a crash: the piece starts anew
            std::error_code ignored;
            fs::remove(job_.work_file(index_), ignored);
            ended = render();
        }
        if (!ended) return fail(ended.error().message, 1, false);
        if (ended->code != 0) return failed_render(*ended);
        return keep_part();
    }

  private:
    void begin() {
        if (state_.state == State::Running || state_.state == State::Lost) {
            note_failure(state_, job_,
                         fmt::format("{} is lost: it reported no end", state_.attempts.back().node),
                         false);
            if (state_.state == State::GaveUp) return;
        }
        Attempt a;
        a.node = options_.node.empty() ? node_name() : options_.node;
        a.host = host_name();
        a.task = task_name();
        a.process = int(::getpid());
        a.start_s = now_s();
        a.log = fmt::format("logs/{:04}.{}.log", index_, state_.attempts.size() + 1);
        state_.attempts.push_back(std::move(a));
        state_.state = State::Running;
        state_.percent = 0;
        state_.part.reset();
        written_s_ = now_s();
    }

    Result<void> write() { return write_piece(job_, index_, state_); }

    Attempt& attempt() { return state_.attempts.back(); }

    Result<ProcessResult> render() {
        ProcessRequest request;
        request.arguments = command_of(job_, index_, options_);
        request.directory = job_.directory;
        request.log = job_.path(attempt().log);
        request.on_line = [this](std::string_view line) { read_line(line); };
        request.is_to_stop = [this] { return look_around(); };
        error_.clear();
        is_resume_refused_ = is_locked_ = false;
        Result<ProcessResult> ended = run_process(request);
        if (ended) {
            attempt().wall_s = now_s() - attempt().start_s;
            attempt().cpu_s += ended->cpu_s;
            attempt().peak_bytes = std::max(attempt().peak_bytes, ended->peak_bytes);
            attempt().code = ended->code;
        }
        return ended;
    }

    void read_line(std::string_view line) {
        if (const double percent = percent_of(line); percent >= 0) {
            state_.percent = percent;
            if (options_.on_progress) options_.on_progress(index_, percent);
        } else if (const size_t at = line.find("error: "); at != std::string_view::npos) {
            constexpr size_t max_length = 400;
            // The last line of a render counts what lacks; one before says what it did about it
            if (error_.empty() || !line.ends_with("[missing-assets]"))
                error_ = std::string(line.substr(0, max_length));
            is_resume_refused_ = is_resume_refused_ || line.ends_with("[resume-refused]");
            is_locked_ = is_locked_ || line.ends_with("[output-locked]");
        }
    }

    /// Some times a second. Returns: whether to stop.
    bool look_around() {
        if (now_s() - written_s_ >= heartbeat_s) {
            written_s_ = now_s();
            // The next one may succeed, and if not, the piece is taken for lost
            (void)write();
            is_stopped_ = is_stopped_ || is_canceled(job_);
        }
        is_stopped_ = is_stopped_ || (options_.is_to_stop && options_.is_to_stop());
        return is_stopped_;
    }

    Result<PieceState> fail(const std::string& reason, int code, bool repeats) {
        attempt().wall_s = std::max(now_s() - attempt().start_s, 1e-3);
        if (code != 0) attempt().code = code;
        note_failure(state_, job_, reason, repeats);
        if (const Result<void> ok = write(); !ok) return ok.error();
        return state_;
    }

    Result<PieceState> failed_render(const ProcessResult& ended) {
        // A signal that the render handles: its samples are in the work file
        if (ended.code > 128 && !ended.is_killed) {
            state_.state = State::Waiting;
            attempt().reason = fmt::format("stopped by signal {}", ended.code - 128);
            if (const Result<void> ok = write(); !ok) return ok.error();
            return state_;
        }
        const std::string why = error_.empty() ? "" : ": " + error_;
        if (ended.is_killed)
            return fail(
                fmt::format("killed by signal {}{}{}", ended.code - 128,
                            ended.code - 128 == 9 ? ", as a machine without memory does" : "", why),
                0, false);
        const bool repeats = ended.code == usage || ended.code == check_failed ||
                             (ended.code == refused && !is_locked_);
        return fail(fmt::format("exit code {}{}", ended.code, why), 0, repeats);
    }

    /// The render is done: what did it leave?
    Result<PieceState> keep_part() {
        Result<Part> part = inspect_part(job_.work_file(index_));
        if (!part) return fail(part.error().message, 1, false);
        std::error_code error;
        fs::rename(job_.work_file(index_), job_.part_file(index_), error);
        if (error)
            return fail(fmt::format("cannot make {}: {}", job_.part_file(index_), error.message()),
                        1, false);
        state_.part = std::move(*part);
        attempt().trace_s = trace_time(stats_file(job_, index_));
        fs::remove(stats_file(job_, index_), error);
        state_.state = State::Done;
        state_.percent = 100;
        if (const Result<void> ok = write(); !ok) return ok.error();
        return state_;
    }

    const Job& job_;
    size_t index_;
    const RunOptions& options_;
    PieceState state_;
    std::string error_;  ///< the last one that was printed
    bool is_resume_refused_ = false, is_locked_ = false, is_stopped_ = false;
    double written_s_ = 0;
};

Error no_part(const std::string& why) {
    return {"farm-part", why};
}

/// Samples [first, end) that a part was to have; nothing: its header does not say so.
std::optional<std::pair<uint64_t, uint64_t>> range_of(const std::string& file) {
    const auto reader = image::ExrReader::open(file);
    const auto header = reader ? layers::read_layer_header(reader->header())
                               : Result<layers::LayerHeader>(reader.error());
    if (!header) return std::nullopt;
    const auto j = nlohmann::json::parse(
        layers::file_info_of(reader->header(), *header).settings_json, nullptr, false);
    if (!j.is_object() || !j.contains("part") || !j["part"].is_object()) return std::nullopt;
    const auto samples = j["part"].value("samples", nlohmann::json());
    if (!samples.is_array() || samples.size() != 2 || !samples[0].is_number_unsigned() ||
        !samples[1].is_number_unsigned())
        return std::nullopt;
    return std::pair(samples[0].get<uint64_t>(), samples[1].get<uint64_t>());
}

/// SHA-256 and length of a file. Errors: "farm-part".
Result<Part> digest_file(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return no_part(fmt::format("cannot read {}", file));
    image::Sha256 sha;
    Part part;
    std::vector<char> buffer(size_t(1) << 20);
    while (stream.read(buffer.data(), std::streamsize(buffer.size())) || stream.gcount() > 0) {
        sha.add(buffer.data(), size_t(stream.gcount()));
        part.bytes += uint64_t(stream.gcount());
    }
    if (stream.bad()) return no_part(fmt::format("cannot read all of {}", file));
    part.sha256 = sha.finish();
    return part;
}

}  // namespace

Result<PieceState> run_piece(const Job& job, size_t piece, const RunOptions& options) {
    // Two machines can be given one piece, where an engine takes the first for dead
    Result<PieceState> state = read_piece(job, piece);
    if (!state) return state.error();
    if (is_canceled(job))
        return Error{"farm-canceled", fmt::format("{} is canceled; `velatura farm retry {}` "
                                                  "continues it",
                                                  job.folder, job.folder)};
    if (state->state == State::Done && problem_of_part(job, piece, *state).empty()) return state;
    return Run(job, piece, options, std::move(*state)).run();
}

Result<Part> inspect_part(const std::string& file) {
    Result<Part> part = digest_file(file);
    if (!part) return part;
    const auto reader = image::ExrReader::open(file);
    if (!reader) return no_part(reader.error().message);
    const auto header = layers::read_layer_header(reader->header());
    if (!header) return no_part(fmt::format("{}: {}", file, header.error().message));
    part->scene = header->samples.scene_hash;
    part->settings = header->samples.settings_hash;
    return part;
}

std::string problem_of_part(const Job& job, size_t piece, const PieceState& state) {
    if (!state.part) return "it is not done";
    std::error_code error;
    const std::string file = job.part_file(piece);
    const uintmax_t bytes = fs::file_size(file, error);
    if (error) return fmt::format("{} is missing", file);
    if (bytes != state.part->bytes)
        return fmt::format("{} is damaged: {} bytes, {} were written", file, bytes,
                           state.part->bytes);
    const Result<Part> found = digest_file(file);
    if (!found) return found.error().message;
    if (found->sha256 != state.part->sha256)
        return fmt::format("{} is damaged: other bytes than were written", file);
    const Piece& p = job.pieces[piece];
    if (const auto range = range_of(file); range && *range != std::pair(p.first, p.end))
        return fmt::format("{} has samples {}:{}, the piece {}:{}", file, range->first,
                           range->second, p.first, p.end);
    return {};
}

std::string node_name() {
    const std::string of_engine = environment("SLURMD_NODENAME");
    return of_engine.empty() ? host_name() : of_engine;
}

std::string task_name() {
    const std::string array = environment("SLURM_ARRAY_JOB_ID");
    if (!array.empty()) return array + "_" + environment("SLURM_ARRAY_TASK_ID");
    for (const char* name : {"SLURM_JOB_ID", "CUE_FRAME_ID"})
        if (const std::string task = environment(name); !task.empty()) return task;
    return {};
}

}  // namespace velatura::farm
