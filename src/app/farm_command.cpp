// SPDX-License-Identifier: Apache-2.0
#include "app/build_id.h"
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/render_job.h"
#include "app/stop_signals.h"
#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/package_path.h"
#include "base/tasks.h"
#include "farm/check.h"
#include "farm/engine.h"
#include "farm/job.h"
#include "farm/local_engine.h"
#include "farm/merge_job.h"
#include "farm/process.h"
#include "farm/rounds.h"
#include "farm/run_piece.h"
#include "farm/status.h"
#include "integrator/sample_placement.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

namespace fs = std::filesystem;

static_assert(farm::pilot_samples == integrator::pilot_samples,
              "a part without rates of adaptive sampling would be refused");

/// The command line of `farm submit` beside the options of the render.
struct SubmitArguments {
    RenderArguments render;
    std::string engine = "local", job, name, program;
    std::string pieces = "auto";
    int retries = 2, slots = 0, chunk = 0;
    std::string account, partition, constraint, show, shot, facility;
    std::vector<std::string> sbatch;
    bool is_dry_run = false;
};

/// Options of a render that pieces have no use for, or whose files do not merge.
constexpr std::array refused_options = {
    "--samples",        "--resumable", "--resume",       "--for-mix",
    "--snapshot",       "--time",      "--rates-from",   "--forecast",
    "--require-target", "--deep",      "--deep-samples", "--crop",
    "--replay",         "--stats",     "--display",      "--display-layers"};

/// Options that a job stores in another form.
constexpr std::array own_options = {
    "--output",       "--frames",          "--spp",     "--checkpoint", "--progress",
    "--target-error", "--quiet",           "--verbose", "--engine",     "--job",
    "--name",         "--program",         "--pieces",  "--retries",    "--slots",
    "--dry-run",      "--overwrite-input", "--account", "--partition",  "--constraint",
    "--sbatch",       "--chunk",           "--show",    "--shot",       "--facility"};

/// The options of the engine, each of which belongs to one. Errors: "usage".
Result<std::vector<std::string>> engine_options(const SubmitArguments& a, farm::Engine engine) {
    using farm::Engine;

    struct Row {
        const char* name;
        const std::string& value;
        std::vector<Engine> engines;
    };

    const std::string chunk = a.chunk > 0 ? std::to_string(a.chunk) : "";
    const std::string threads = a.render.threads > 0 ? std::to_string(a.render.threads) : "";
    const Row rows[] = {{"account", a.account, {Engine::Slurm}},
                        {"partition", a.partition, {Engine::Slurm}},
                        {"constraint", a.constraint, {Engine::Slurm}},
                        {"show", a.show, {Engine::OpenCue}},
                        {"shot", a.shot, {Engine::OpenCue}},
                        {"facility", a.facility, {Engine::OpenCue}},
                        {"chunk", chunk, {Engine::OpenCue, Engine::OpenJobDescription}}};
    std::vector<std::string> words;
    for (const Row& row : rows) {
        if (row.value.empty()) continue;
        if (std::find(row.engines.begin(), row.engines.end(), engine) == row.engines.end())
            return Error{"usage", fmt::format("--{} has no effect with --engine {}", row.name,
                                              farm::name_of(engine))};
        words.push_back(fmt::format("--{}={}", row.name, row.value));
    }
    if (!a.sbatch.empty() && engine != Engine::Slurm)
        return Error{"usage", "--sbatch needs --engine slurm"};
    if (!threads.empty() && engine == Engine::Slurm) words.push_back("--cpus-per-task=" + threads);
    if (!threads.empty() && engine == Engine::OpenCue) words.push_back("--threads=" + threads);
    words.insert(words.end(), a.sbatch.begin(), a.sbatch.end());
    return words;
}

/// The output without extension and frame number, as a folder.
std::string default_folder(const std::string& output) {
    const fs::path path = with_hashes(output);
    std::string stem = path.stem().string();
    while (!stem.empty() && std::string_view("#._-").find(stem.back()) != std::string_view::npos)
        stem.pop_back();
    return (path.parent_path() / (stem + ".farm")).string();
}

/// As `velatura render` names the file of a frame.
std::string output_of(const std::string& pattern, const std::string& frame, bool has_many) {
    const fs::path path = pattern;
    const std::string name =
        has_many && !is_sequence(pattern)
            ? (path.parent_path() / (path.stem().string() + ".####" + path.extension().string()))
                  .string()
            : pattern;
    return fs::absolute(frame.empty() ? name : frame_path(name, std::stod(frame)))
        .lexically_normal()
        .string();
}

Result<std::vector<std::string>> frames_of(const RenderArguments& a) {
    if (a.frames.empty() || a.frames == "default") return std::vector<std::string>{a.frames};
    const auto parsed = parse_frames(a.frames);
    if (!parsed) return Error{"usage", "--frames: " + parsed.error().message};
    std::vector<std::string> frames;
    for (const double frame : *parsed) frames.push_back(fmt::format("{}", frame));
    return frames;
}

/// Of --pieces; 0: auto.
Result<uint64_t> piece_count(const SubmitArguments& a, uint64_t spp) {
    if (a.pieces == "auto") return 0;
    const auto refuse = [&] {
        return Error{
            "usage",
            fmt::format("--pieces: expected auto or 1 to {} (--spp), found \"{}\"", spp, a.pieces)};
    };
    const bool is_number = !a.pieces.empty() && a.pieces.size() < 10 &&
                           a.pieces.find_first_not_of("0123456789") == std::string::npos;
    if (!is_number) return refuse();
    const uint64_t count = std::stoull(a.pieces);
    if (count < 1 || count > spp) return refuse();
    return count;
}

/// Errors: "usage", "file-not-found".
Result<farm::Job> make_job(const SubmitArguments& a, const Command& command) {
    for (const char* name : refused_options)
        if (command.find_option(name).count() > 0)
            return Error{"usage", fmt::format("{} cannot be used in a farm job", name)};
    if (a.render.output.empty()) return Error{"usage", "-o FILE is required: the final image"};
    if (a.render.exr_layout == "split")
        return Error{"usage", "--exr-layout split cannot be used in a farm job"};
    if (a.render.firefly_guard == "auto")
        return Error{
            "usage",
            "--firefly-guard auto cannot be used in a farm job, whose pieces have a part of the "
            "samples; --firefly-guard N: the samples per pixel of the whole image"};
    const Result<RenderJob> checked = make_render_job(a.render);
    if (!checked) return checked.error();
    if (!fs::exists(split_package_path(a.render.scene).front()))
        return Error{"file-not-found", fmt::format("{} not found", a.render.scene)};
    const auto engine = farm::engine_of(a.engine);
    if (!engine) return engine.error();
    const auto for_engine = engine_options(a, *engine);
    if (!for_engine) return for_engine.error();
    const auto frames = frames_of(a.render);
    if (!frames) return frames.error();

    farm::Job job;
    job.engine = *engine;
    job.engine_options = *for_engine;
    const std::string folder = a.job.empty() ? default_folder(a.render.output) : a.job;
    job.folder = fs::absolute(folder).lexically_normal().string();
    while (job.folder.size() > 1 && job.folder.back() == '/') job.folder.pop_back();
    job.name = a.name.empty() ? fs::path(job.folder).stem().string() : a.name;
    job.program = a.program.empty() ? farm::own_program() : a.program;
    job.build = std::string(build_id());
    job.directory = fs::current_path().string();
    job.scene = a.render.scene;
    std::vector<std::string> except(refused_options.begin(), refused_options.end());
    except.insert(except.end(), own_options.begin(), own_options.end());
    job.options = command.given_words(except);
    if (!a.render.checkpoint.empty()) job.checkpoint = a.render.checkpoint;
    if (a.render.mode == "tile") job.checkpoint.clear();  // which writes none before its end
    job.retries = a.retries;
    job.slots = a.slots;
    job.frames = *frames;
    if (a.render.frames == "default") {
        job.options.emplace_back("--frames=default");
        job.frames = {""};
    }
    for (const std::string& frame : job.frames)
        job.outputs.push_back(output_of(a.render.output, frame, job.frames.size() > 1));
    const integrator::RenderOptions& schedule = checked->settings.schedule;
    uint64_t spp = a.render.spp.value_or(default_spp);
    job.target_error = schedule.target_error;
    if (job.target_error > 0) {
        if (job.engine != farm::Engine::Local && job.engine != farm::Engine::Slurm)
            return Error{"usage", fmt::format("--target-error needs --engine local or slurm: the "
                                              "tasks of {} cannot be added to",
                                              farm::name_of(job.engine))};
        job.max_spp = schedule.end_sample;
        spp = std::min<uint64_t>(job.max_spp, default_spp);
    }
    const auto ranges = piece_count(a, spp);
    if (!ranges) return ranges.error();
    job.ranges = *ranges;
    const uint64_t count =
        job.ranges > 0 ? job.ranges : farm::default_pieces(spp, job.frames.size());
    for (size_t frame = 0; frame < job.frames.size(); ++frame)
        for (farm::Piece piece : farm::split_samples(0, spp, count)) {
            piece.frame = frame;
            job.pieces.push_back(piece);
        }
    job.first_pieces = job.pieces.size();
    return job;
}

farm::RunOptions run_options() {
    farm::RunOptions options;
    options.build = std::string(build_id());
    options.is_to_stop = [] { return StopSignals::stop_flag().load(); };
    return options;
}

/// Frames whose error is above the target though they have all samples of --spp.
void warn_of_targets(const farm::Job& job, const farm::JobStatus& status) {
    if (job.target_error <= 0) return;
    for (size_t frame = 0; frame < job.frames.size(); ++frame) {
        const std::optional<farm::ErrorAt>& e = status.errors[frame];
        if (e && e->error > job.target_error)
            fmt::print(stderr,
                       "warning: {}: error {:.3g} %, target {:.3g} %, at the limit of {} samples "
                       "per pixel; raise --spp [budget]\n",
                       job.outputs[frame], 100 * e->error, 100 * job.target_error, e->spp);
        else if (!e)
            fmt::print(stderr, "warning: {}: its error is not known [budget]\n",
                       job.outputs[frame]);
    }
}

/// About a round that begins.
std::string round_text(const farm::Job& job, const std::vector<size_t>& pieces) {
    const farm::Piece& last = job.pieces[pieces.back()];
    return fmt::format(
        "another round for an error of {:.3g} %: {} pieces, up to {} samples per "
        "pixel",
        100 * job.target_error, pieces.size(), last.end);
}

/// Of a job that ended, or was left: prints what lacks.
int end_of(const farm::Job& job, bool is_quiet) {
    const auto status = farm::status_of(job);
    if (!status) return fail(status.error());
    if (status->state == farm::JobState::Complete) {
        if (!is_quiet)
            for (const std::string& output : job.outputs) fmt::print("{}\n", output);
        warn_of_targets(job, *status);
        return Done;
    }
    fmt::print(stderr, "error: {} of {} frames of {} are not written [farm-incomplete]\n",
               job.frames.size() - status->merged_count(), job.frames.size(), job.folder);
    fmt::print(stderr, "{}", farm::incomplete_text(job, *status));
    return StopSignals::stop_flag() ? SignalBase + StopSignals::signal_number() : int(RenderError);
}

/// The same of the job as its folder has it now, with all of its rounds.
int end_of_folder(const std::string& folder, bool is_quiet) {
    const auto job = farm::read_job(folder);
    return job ? end_of(*job, is_quiet) : fail(job.error());
}

/// Runs what lacks of a job on this machine.
int run_here(const farm::Job& job, bool is_quiet) {
    const StopSignals signals;
    farm::LocalOptions options;
    options.run = run_options();
    options.run.threads =
        std::max(1, int(std::thread::hardware_concurrency()) / std::max(1, job.slots));
    options.on_round = [&](const farm::Job& now, const std::vector<size_t>& pieces) {
        if (!is_quiet) fmt::print("{}\n", round_text(now, pieces));
        std::fflush(stdout);
    };
    options.on_piece = [&](const farm::Job& now, size_t piece, const farm::PieceState& s) {
        const farm::Attempt& a = s.attempts.back();
        if (s.state == farm::State::Done && !is_quiet)
            fmt::print("{} done in {:.1f} s\n", now.title(piece), a.wall_s);
        if (s.state == farm::State::Failed || s.state == farm::State::GaveUp)
            fmt::print(stderr, "warning: {} failed on {}: {}; {} [farm-piece-failed]\n",
                       now.title(piece), a.node, a.reason,
                       s.state == farm::State::Failed ? "trying again" : "giving up");
        std::fflush(stdout);
    };
    if (const Result<void> ran = farm::run_local(job, options); !ran) return fail(ran.error());
    return end_of_folder(job.folder, is_quiet);
}

/// Gives what lacks of a job to its engine.
int start_job(const farm::Job& job, bool is_quiet) {
    if (job.engine == farm::Engine::Local) return run_here(job, is_quiet);
    const auto states = farm::read_pieces(job);
    if (!states) return fail(states.error());
    std::vector<size_t> pieces;
    for (size_t i = 0; i < states->size(); ++i)
        if ((*states)[i].state != farm::State::Done && (*states)[i].state != farm::State::Running)
            pieces.push_back(i);
    const auto submitted = farm::submit_pieces(job, pieces);
    if (!submitted) return fail(submitted.error());
    if (!is_quiet) fmt::print("{}\n", *submitted);
    return Done;
}

int run_submit(const SubmitArguments& a, const Command& command) {
    const Result<farm::Job> job = make_job(a, command);
    if (!job) return fail(job.error());
    if (const Result<void> made = farm::create_job(*job); !made) return fail(made.error());
    if (!a.render.quiet) {
        fmt::print("{}: {} pieces of {} frame{}\n", job->folder, job->pieces.size(),
                   job->frames.size(), job->frames.size() == 1 ? "" : "s");
        std::fflush(stdout);
    }
    return a.is_dry_run ? int(Done) : start_job(*job, a.render.quiet);
}

struct StatusArguments {
    std::string job;
    bool as_json = false, all = false, watches = false;
    double price = 0;
};

/// Returns: the state that was shown. Errors: those of read_job and status_of.
Result<farm::JobState> show_status(const StatusArguments& a, const char* before) {
    const auto job = farm::read_job(a.job);
    if (!job) return job.error();
    const auto status = farm::status_of(*job);
    if (!status) return status.error();
    fmt::print("{}{}", before,
               a.as_json ? farm::status_json(*job, *status, a.price)
                         : farm::status_text(*job, *status, a.all, a.price));
    std::fflush(stdout);
    return status->state;
}

/// False where a signal says to stop before that.
bool wait_a_second() {
    for (int i = 0; i < 5; ++i) {
        if (StopSignals::stop_flag()) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    return true;
}

int run_status(const StatusArguments& a) {
    const StopSignals signals;
    // Of a terminal the screen is cleared
    const char* const again = ::isatty(STDOUT_FILENO) ? "\033[H\033[2J" : "\n";
    for (const char* before = a.watches && again[0] == '\033' ? again : "";; before = again) {
        const auto state = show_status(a, before);
        if (!state) return fail(state.error());
        const bool goes_on = *state == farm::JobState::Waiting || *state == farm::JobState::Running;
        if (!a.watches || !goes_on || !wait_a_second() || !wait_a_second()) return Done;
    }
}

int run_wait(const std::string& folder, bool is_quiet) {
    const StopSignals signals;
    // Between two pieces no process holds a piece of the job
    for (int ended = 0; ended < 3;) {
        // Rounds add pieces
        const auto job = farm::read_job(folder);
        if (!job) return fail(job.error());
        const auto status = farm::status_of(*job);
        if (!status) return fail(status.error());
        using farm::JobState;
        if (status->state == JobState::Complete) break;
        ended = status->state == JobState::Incomplete || status->state == JobState::Canceled
                    ? ended + 1
                    : 0;
        if (!wait_a_second()) return SignalBase + StopSignals::signal_number();
    }
    return end_of_folder(folder, is_quiet);
}

int run_cancel(const std::string& folder) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    if (const auto ok = write_file_atomically(job->cancel_file(), ""); !ok) return fail(ok.error());
    const Result<void> canceled = farm::cancel_tasks(*job);
    return canceled ? int(Done) : fail(canceled.error());
}

int run_retry(const std::string& folder, bool is_quiet) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    if (const auto ok = farm::reset_failures(*job); !ok) return fail(ok.error());
    return start_job(*job, is_quiet);
}

/// Slurm's warning before a time limit or a preemption, which it sends to this process alone.
std::atomic<bool> is_warned = false;

void on_warning(int) {
    is_warned = true;
}

struct TaskArguments {
    std::string job, pieces, progress = "none";
    bool resubmits = false;
};

/// Lines of Open Job Description about a piece.
class TaskProgress {
  public:
    TaskProgress(const farm::Job& job, bool is_shown) : job_(job), is_shown_(is_shown) {}

    void show(size_t piece, double percent) const {
        if (!is_shown_) return;
        fmt::print("openjd_progress: {:.1f}\nopenjd_status: {}\n", percent, job_.title(piece));
        std::fflush(stdout);
    }

    void fail(const std::string& why) const {
        if (is_shown_) fmt::print("openjd_fail: {}\n", why);
    }

  private:
    const farm::Job& job_;
    bool is_shown_;
};

/// Starts this task of Slurm again, which then ends this process.
void requeue() {
    if (!farm::requeue_this_task()) return;
    for (int i = 0; i < 600 && !StopSignals::stop_flag(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

/// The exit code of a task whose piece is not done.
int code_of(const farm::Job& job, const farm::Attempt& a) {
    // OpenCue raises the memory of a frame that ends so, and starts it again
    constexpr int opencue_memory = 33;
    if (a.code == MemoryReached && job.engine == farm::Engine::OpenCue) return opencue_memory;
    return a.code == 0 ? int(RenderError) : a.code;
}

int run_one_piece(const farm::Job& job, size_t piece, const TaskProgress& progress) {
    farm::RunOptions options = run_options();
    options.is_to_stop = [] { return StopSignals::stop_flag() || is_warned; };
    options.on_progress = [&](size_t i, double percent) { progress.show(i, percent); };
    Result<farm::PieceState> state = farm::run_piece(job, piece, options);
    // No template can ask for another try
    while (state && state->state == farm::State::Failed &&
           job.engine == farm::Engine::OpenJobDescription && !StopSignals::stop_flag())
        state = farm::run_piece(job, piece, options);
    if (!state) {
        progress.fail(state.error().message);
        return app::fail(state.error());
    }
    const farm::Attempt& a = state->attempts.back();
    if (state->state == farm::State::Done) {
        fmt::print("{} done on {} in {:.1f} s\n", job.title(piece), a.node, a.wall_s);
        std::fflush(stdout);
        return Done;
    }
    const std::string why =
        fmt::format("{} {} on {}: {}", job.title(piece),
                    state->state == farm::State::Waiting ? "stopped" : "failed", a.node, a.reason);
    progress.fail(why);
    fmt::print(stderr, "error: {} [farm-piece-failed]\n", why);
    std::fflush(stdout);
    if (job.engine == farm::Engine::Slurm && (state->state == farm::State::Failed ||
                                              (state->state == farm::State::Waiting && is_warned)))
        requeue();
    return code_of(job, a);
}

int run_pieces(const TaskArguments& a) {
    const auto job = farm::read_job(a.job);
    if (!job) return fail(job.error());
    const auto pieces = parse_whole_frames(a.pieces);
    if (!pieces || pieces->front() < 0)
        return fail({"usage", fmt::format("piece: expected numbers such as 3 or 4-7, found \"{}\"",
                                          a.pieces)});
    const StopSignals signals;
    std::signal(SIGUSR2, on_warning);
    const TaskProgress progress(*job, a.progress == "openjd");
    int worst = Done;
    for (const int piece : *pieces) {
        worst = worse_exit_code(worst, run_one_piece(*job, size_t(piece), progress));
        if (StopSignals::stop_flag() || is_warned) break;
    }
    return worst;
}

/// Of a merge that found pieces which can be tried again.
int resubmit(const farm::Job& job) {
    const auto states = farm::read_pieces(job);
    if (!states) return fail(states.error());
    std::vector<size_t> pieces;
    for (size_t i = 0; i < states->size(); ++i) {
        const farm::State s = (*states)[i].state;
        if (s == farm::State::Canceled) return end_of(job, false);
        if (s != farm::State::Done && s != farm::State::GaveUp) pieces.push_back(i);
    }
    if (pieces.empty()) return end_of(job, false);
    const auto submitted = farm::submit_pieces(job, pieces);
    if (!submitted) return fail(submitted.error());
    fmt::print("{} pieces again; {}\n", pieces.size(), *submitted);
    return Done;
}

int run_merge(const TaskArguments& a) {
    Result<farm::Job> job = farm::read_job(a.job);
    if (!job) return fail(job.error());
    const StopSignals signals;
    const TaskProgress progress(*job, a.progress == "openjd");
    if (const auto merged = farm::merge_frames(*job); !merged) {
        progress.fail(merged.error().message);
        return fail(merged.error());
    }
    if (a.resubmits) {
        const auto round = farm::add_round(*job);
        if (!round) return fail(round.error());
        if (!round->empty()) fmt::print("{}\n", round_text(*job, *round));
    }
    const int code = a.resubmits ? resubmit(*job) : end_of(*job, false);
    if (code != Done) progress.fail("pieces are missing; see the log of the merge");
    return code;
}

/// Checks this machine, and compares it with those that were checked before.
int run_check(const std::string& folder) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    const auto own = farm::check_machine(*job, std::string(build_id()));
    if (!own) return fail(own.error());
    const auto checks = farm::read_checks(*job);
    if (!checks) return fail(checks.error());
    const std::vector<std::string> lines = farm::differing_machines(*job, *checks);
    for (const std::string& line : lines) fmt::print(stderr, "error: {} [farm-machine]\n", line);
    if (!lines.empty()) return RenderError;
    fmt::print("{} ({}): {} machines checked, all alike\n", own->node, own->processor,
               checks->size());
    return Done;
}

void add_submit(Command farm, std::function<int()>& run) {
    Command command = farm.add_subcommand(
        "submit",
        "Split a render into pieces, render them on several machines or on this one, and merge "
        "them; takes the options of render");
    const auto a = std::make_shared<SubmitArguments>();
    declare_render_options(command, a->render);
    for (const char* name : refused_options) command.find_option(name).hidden();
    command.find_option("--output").default_text("");
    command.find_option("--target-error")
        .description(
            "Relative error at which a frame is done: rounds of pieces are added until the merged "
            "image states it, or up to --spp; engines local and slurm");
    command.find_option("--checkpoint")
        .description("Checkpoint interval of a piece: what it keeps when its machine fails")
        .default_text("5m");
    Command group = command.add_group("Farm");
    group
        .add_option("--engine", a->engine,
                    "Engine that runs the pieces: local (this machine; returns when all is done), "
                    "slurm (sbatch), openjd (writes a template of Open Job Description), opencue "
                    "(writes a job of OpenCue)")
        .one_of({"local", "slurm", "openjd", "opencue"})
        .common();
    group.add_option("--job", a->job, "Job folder, which all machines can write")
        .type_name("DIR")
        .default_text("the output's name with .farm")
        .not_empty()
        .common();
    group
        .add_option("--pieces", a->pieces,
                    "Sample ranges of a frame; auto: 1 of several frames, else up to 16 of 16 spp "
                    "or more")
        .type_name("N|auto")
        .common();
    group.add_option("--slots", a->slots, "Maximum pieces at a time; 0: local 1")
        .range(0, 100000)
        .common();
    group
        .add_option("--retries", a->retries,
                    "Maximum further tries of a piece that failed; pieces stopped by a signal do "
                    "not count")
        .range(0, 100)
        .common();
    group.add_option("--name", a->name, "Name of the job")
        .default_text("that of the folder")
        .not_empty();
    group.add_option("--program", a->program, "velatura on the machines that render")
        .type_name("PATH")
        .default_text("this program")
        .not_empty();
    group.add_option("--account", a->account, "Slurm account").not_empty();
    group.add_option("--partition", a->partition, "Slurm partition").not_empty();
    group.add_option("--constraint", a->constraint, "Slurm constraint: features of nodes")
        .type_name("LIST")
        .not_empty();
    group
        .add_option("--sbatch", a->sbatch,
                    "Option of sbatch for pieces and merge, e.g. --sbatch=--mem=8G")
        .type_name("WORD")
        .expected(1)
        .take_all();
    group
        .add_option("--chunk", a->chunk,
                    "Pieces of a task: openjd (extension TASK_CHUNKING) and opencue")
        .range(1, 10000)
        .default_text("1");
    group.add_option("--show", a->show, "OpenCue show").default_text("velatura").not_empty();
    group.add_option("--shot", a->shot, "OpenCue shot").default_text("shot").not_empty();
    group.add_option("--facility", a->facility, "OpenCue facility")
        .default_text("local")
        .not_empty();
    group.add_flag("--dry-run", a->is_dry_run, "Write the job folder, and start nothing");
    command.example(
        "velatura farm submit shot.usda -o shot.exr --spp 256 --pieces 8 --job shot.farm");
    command.callback(
        [a, command, &run] { run = [a, command] { return run_submit(*a, command); }; });
}

Option add_job(Command& command, std::string& folder) {
    return command.add_option("job", folder, "Job folder").required().type_name("DIR");
}

void add_status(Command farm, std::function<int()>& run) {
    Command command = farm.add_subcommand("status", "Show the pieces of a job, from its files");
    const auto a = std::make_shared<StatusArguments>();
    add_job(command, a->job);
    command.add_flag("--json", a->as_json, "Print JSON");
    command.add_flag("--all", a->all, "List every piece, not only those that run or failed");
    command.add_flag("--watch", a->watches, "Show it again every 2 s until the job ends");
    command.add_option("--price", a->price, "Price of a CPU hour: print the cost")
        .range(0.0, 1e9)
        .default_text("none");
    command.example("velatura farm status shot.farm");
    command.callback([a, &run] { run = [a] { return run_status(*a); }; });
}

struct JobArguments {
    std::string job;
    bool is_quiet = false;
};

/// What engines start.
void add_tasks(Command farm, std::function<int()>& run) {
    const auto a = std::make_shared<TaskArguments>();
    Command pieces = farm.add_subcommand("run", "Render pieces of a job: what engines start");
    Command merge = farm.add_subcommand(
        "merge", "Merge the frames of a job whose pieces are done: what engines start");
    for (Command* command : {&pieces, &merge}) {
        add_job(*command, a->job);
        command->add_option("--progress", a->progress, "Progress format")
            .one_of({"none", "openjd"});
    }
    pieces.add_option("piece", a->pieces, "Numbers of pieces from 0, e.g. 3 or 4-7")
        .required()
        .type_name("LIST");
    merge.add_flag("--resubmit", a->resubmits,
                   "Give pieces that can be tried again to the engine, with another merge");
    pieces.example("velatura farm run shot.farm 3");
    pieces.callback([a, &run] { run = [a] { return run_pieces(*a); }; });
    merge.callback([a, &run] { run = [a] { return run_merge(*a); }; });
}

/// A command of a job alone.
Command add_job_command(Command farm,
                        const std::string& name,
                        const std::string& help,
                        const std::function<int(const JobArguments&)>& action,
                        const std::shared_ptr<JobArguments>& a,
                        std::function<int()>& run) {
    Command command = farm.add_subcommand(name, help);
    add_job(command, a->job);
    command.callback([a, action, &run] { run = [a, action] { return action(*a); }; });
    return command;
}

}  // namespace

void add_farm_command(Command& app, std::function<int()>& run) {
    Command farm = app.add_subcommand(
        "farm", "Render on several machines: submit, check, status, wait, cancel, retry");
    farm.require_subcommand();
    add_submit(farm, run);
    add_status(farm, run);
    const auto a = std::make_shared<JobArguments>();
    add_job_command(
        farm, "check",
        "Pre-flight: render a tiny piece of a job on this machine, and compare build, plugins and "
        "files with the machines that were checked before",
        [](const JobArguments& j) { return run_check(j.job); }, a, run);
    add_job_command(
        farm, "wait", "Wait for the end of a job; exit code 0 if every frame is written, else 1",
        [](const JobArguments& j) { return run_wait(j.job, j.is_quiet); }, a, run)
        .add_flag("-q,--quiet", a->is_quiet, "Print errors only");
    add_job_command(
        farm, "cancel", "Stop the pieces of a job; `retry` continues it",
        [](const JobArguments& j) { return run_cancel(j.job); }, a, run);
    add_job_command(
        farm, "retry", "Render what a job lacks, where it failed, was stopped or canceled",
        [](const JobArguments& j) { return run_retry(j.job, j.is_quiet); }, a, run)
        .add_flag("-q,--quiet", a->is_quiet, "Print errors only");
    add_tasks(farm, run);
}

}  // namespace velatura::app
