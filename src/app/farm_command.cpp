// SPDX-License-Identifier: Apache-2.0
#include "app/build_id.h"
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/render_job.h"
#include "app/stop_signals.h"
#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/package_path.h"
#include "base/tasks.h"
#include "farm/job.h"
#include "farm/local_engine.h"
#include "farm/merge_job.h"
#include "farm/process.h"
#include "farm/run_piece.h"
#include "farm/status.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

namespace fs = std::filesystem;

/// The command line of `farm submit` beside the options of the render.
struct SubmitArguments {
    RenderArguments render;
    std::string engine = "local", job, name, program;
    std::string pieces = "auto";
    int retries = 2, slots = 0;
    bool is_dry_run = false;
};

int fail(const Error& error, int code = RenderError) {
    fmt::print(stderr, "error: {} [{}]\n", error.message, error.code);
    return error.code == "usage" ? int(UsageError) : code;
}

/// Options of a render that pieces have no use for, or whose files do not merge.
constexpr std::array refused_options = {
    "--samples",      "--resumable",    "--resume",   "--for-mix",        "--snapshot",
    "--time",         "--target-error", "--forecast", "--require-target", "--deep",
    "--deep-samples", "--crop",         "--replay",   "--stats"};

/// Options that a job stores in another form.
constexpr std::array own_options = {"--output",   "--frames", "--spp",     "--checkpoint",
                                    "--progress", "--quiet",  "--verbose", "--engine",
                                    "--job",      "--name",   "--program", "--pieces",
                                    "--retries",  "--slots",  "--dry-run", "--overwrite-input"};

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

Result<uint64_t> piece_count(const SubmitArguments& a, uint64_t spp, size_t frames) {
    if (a.pieces == "auto") return farm::default_pieces(spp, frames);
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
    const Result<RenderJob> checked = make_render_job(a.render);
    if (!checked) return checked.error();
    if (!fs::exists(split_package_path(a.render.scene).front()))
        return Error{"file-not-found", fmt::format("{} not found", a.render.scene)};
    const auto engine = farm::engine_of(a.engine);
    if (!engine) return engine.error();
    const auto frames = frames_of(a.render);
    if (!frames) return frames.error();

    farm::Job job;
    job.engine = *engine;
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
    const uint64_t spp = a.render.spp.value_or(default_spp);
    const auto count = piece_count(a, spp, job.frames.size());
    if (!count) return count.error();
    for (size_t frame = 0; frame < job.frames.size(); ++frame)
        for (farm::Piece piece : farm::split_samples(spp, *count)) {
            piece.frame = frame;
            job.pieces.push_back(piece);
        }
    return job;
}

farm::RunOptions run_options() {
    farm::RunOptions options;
    options.build = std::string(build_id());
    options.is_to_stop = [] { return StopSignals::stop_flag().load(); };
    return options;
}

/// Of a job that ended, or was left: prints what lacks.
int end_of(const farm::Job& job, bool is_quiet) {
    const auto status = farm::status_of(job);
    if (!status) return fail(status.error());
    if (status->state == farm::JobState::Complete) {
        if (!is_quiet)
            for (const std::string& output : job.outputs) fmt::print("{}\n", output);
        return Done;
    }
    fmt::print(stderr, "error: {} of {} frames of {} are not written [farm-incomplete]\n",
               job.frames.size() - status->merged_count(), job.frames.size(), job.folder);
    fmt::print(stderr, "{}", farm::incomplete_text(job, *status));
    return StopSignals::stop_flag() ? SignalBase + StopSignals::signal_number() : int(RenderError);
}

/// Runs what lacks of a job on this machine.
int run_here(const farm::Job& job, bool is_quiet) {
    const StopSignals signals;
    farm::LocalOptions options;
    options.run = run_options();
    options.run.threads =
        std::max(1, int(std::thread::hardware_concurrency()) / std::max(1, job.slots));
    options.on_piece = [&](size_t piece, const farm::PieceState& s) {
        const farm::Attempt& a = s.attempts.back();
        if (s.state == farm::State::Done && !is_quiet)
            fmt::print("{} done in {:.1f} s\n", job.title(piece), a.wall_s);
        if (s.state == farm::State::Failed || s.state == farm::State::GaveUp)
            fmt::print(stderr, "warning: {} failed on {}: {}; {} [farm-piece-failed]\n",
                       job.title(piece), a.node, a.reason,
                       s.state == farm::State::Failed ? "trying again" : "giving up");
        std::fflush(stdout);
    };
    if (const Result<void> ran = farm::run_local(job, options); !ran) return fail(ran.error());
    return end_of(job, is_quiet);
}

/// Gives what lacks of a job to its engine.
int start_job(const farm::Job& job, bool is_quiet) {
    return run_here(job, is_quiet);
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

int run_status(const std::string& folder, bool as_json, bool all, double price) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    const auto status = farm::status_of(*job);
    if (!status) return fail(status.error());
    fmt::print("{}", as_json ? farm::status_json(*job, *status, price)
                             : farm::status_text(*job, *status, all, price));
    return Done;
}

int run_wait(const std::string& folder, bool is_quiet) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    const StopSignals signals;
    // Between two pieces a job looks like one that nobody runs
    for (int ended = 0; ended < 3;) {
        const auto status = farm::status_of(*job);
        if (!status) return fail(status.error());
        using farm::JobState;
        if (status->state == JobState::Complete) break;
        ended = status->state == JobState::Incomplete || status->state == JobState::Canceled
                    ? ended + 1
                    : 0;
        for (int i = 0; i < 5; ++i) {
            if (StopSignals::stop_flag()) return SignalBase + StopSignals::signal_number();
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
    }
    return end_of(*job, is_quiet);
}

int run_cancel(const std::string& folder) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    if (const auto ok = write_file_atomically(job->cancel_file(), ""); !ok) return fail(ok.error());
    return Done;
}

int run_retry(const std::string& folder, bool is_quiet) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    if (const auto ok = farm::reset_failures(*job); !ok) return fail(ok.error());
    return start_job(*job, is_quiet);
}

int run_one_piece(const std::string& folder, uint64_t piece) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    const StopSignals signals;
    const auto state = farm::run_piece(*job, piece, run_options());
    if (!state) return fail(state.error());
    const farm::Attempt& a = state->attempts.back();
    if (state->state == farm::State::Done) {
        fmt::print("{} done on {} in {:.1f} s\n", job->title(piece), a.node, a.wall_s);
        return Done;
    }
    fmt::print(stderr, "error: {} failed on {}: {} [farm-piece-failed]\n", job->title(piece),
               a.node, a.reason);
    return a.code == 0 ? int(RenderError) : a.code;
}

int run_merge(const std::string& folder) {
    const auto job = farm::read_job(folder);
    if (!job) return fail(job.error());
    const StopSignals signals;
    if (const auto merged = farm::merge_frames(*job); !merged) return fail(merged.error());
    return end_of(*job, false);
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
    command.find_option("--checkpoint")
        .description("Checkpoint interval of a piece: what it keeps when its machine fails")
        .default_text("5m");
    Command group = command.add_group("Farm");
    group
        .add_option("--engine", a->engine,
                    "Engine that runs the pieces: local (this machine; returns when all is done)")
        .one_of({"local"})
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
    struct Arguments {
        std::string job;
        bool as_json = false, all = false;
        double price = 0;
    };

    Command command = farm.add_subcommand("status", "Show the pieces of a job, from its files");
    const auto a = std::make_shared<Arguments>();
    add_job(command, a->job);
    command.add_flag("--json", a->as_json, "Print JSON");
    command.add_flag("--all", a->all, "List every piece, not only those that run or failed");
    command.add_option("--price", a->price, "Price of a CPU hour: print the cost")
        .range(0.0, 1e9)
        .default_text("none");
    command.example("velatura farm status shot.farm");
    command.callback(
        [a, &run] { run = [a] { return run_status(a->job, a->as_json, a->all, a->price); }; });
}

struct JobArguments {
    std::string job;
    bool is_quiet = false;
    uint64_t piece = 0;
};

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
        "farm", "Render on several machines: submit, status, wait, cancel, retry");
    farm.require_subcommand();
    add_submit(farm, run);
    add_status(farm, run);
    const auto a = std::make_shared<JobArguments>();
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
    Command piece = add_job_command(
        farm, "run", "Render one piece of a job: what engines start",
        [](const JobArguments& j) { return run_one_piece(j.job, j.piece); }, a, run);
    piece.add_option("piece", a->piece, "Number of the piece, from 0").required();
    add_job_command(
        farm, "merge", "Merge the frames of a job whose pieces are done: what engines start",
        [](const JobArguments& j) { return run_merge(j.job); }, a, run);
}

}  // namespace velatura::app
