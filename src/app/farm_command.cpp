// SPDX-License-Identifier: Apache-2.0
#include "app/build_id.h"
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/farm_submit.h"
#include "app/stop_signals.h"
#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/output_lock.h"
#include "base/tasks.h"
#include "farm/check.h"
#include "farm/engine.h"
#include "farm/job.h"
#include "farm/local_engine.h"
#include "farm/merge_job.h"
#include "farm/preview.h"
#include "farm/process.h"
#include "farm/rounds.h"
#include "farm/run_piece.h"
#include "farm/status.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

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
        const std::string& limit = status.limits[frame];
        if (e && e->error > job.target_error)
            fmt::print(stderr,
                       "warning: {}: error {:.3g} %, target {:.3g} %, at the limit of {}; a new "
                       "job with a higher {} gets further [budget]\n",
                       job.outputs[frame], 100 * e->error, 100 * job.target_error,
                       limit.empty() ? fmt::format("{} samples per pixel", e->spp)
                                     : fmt::format("{} after {} samples per pixel", limit, e->spp),
                       limit.empty() ? "--spp" : limit);
    }
}

/// About a round that begins.
std::string round_text(const farm::Job& job, const std::vector<size_t>& pieces) {
    const farm::Piece& last = job.pieces[pieces.back()];
    if (job.target_error <= 0)
        return fmt::format("{} further pieces, by what the first ones took", pieces.size());
    return fmt::format(
        "another round for an error of {:.3g} %: {} pieces, up to {} samples per pixel",
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

/// For who adds pieces to a job, or gives some to its engine: one at a time.
Result<OutputLock> lock_rounds(const farm::Job& job) {
    constexpr double longest_s = 600;
    return OutputLock::wait_for(job.path("rounds.json"), longest_s);
}

/// Gives what lacks of a job to its engine.
int start_job(const farm::Job& given, bool is_quiet) {
    if (given.engine == farm::Engine::Local) return run_here(given, is_quiet);
    const Result<OutputLock> lock = lock_rounds(given);
    if (!lock) return fail(lock.error());
    const Result<farm::Job> job = farm::read_job(given.folder);
    if (!job) return fail(job.error());
    const auto states = farm::read_pieces(*job);
    if (!states) return fail(states.error());
    const auto held = farm::held_pieces(*job).value_or(std::set<size_t>());
    std::vector<size_t> pieces;
    for (size_t i = 0; i < states->size(); ++i)
        if ((*states)[i].state != farm::State::Done && (*states)[i].state != farm::State::Running &&
            !held.contains(i))
            pieces.push_back(i);
    const auto submitted = farm::submit_pieces(*job, pieces);
    if (!submitted) return fail(submitted.error());
    if (!is_quiet) fmt::print("{}\n", *submitted);
    return Done;
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
        farm::merge_finished_frame(job, job.pieces[piece].frame);
        (void)farm::renew_preview(job, job.pieces[piece].frame);  // ends nothing if it fails
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
    for (const int signal : {SIGUSR1, SIGUSR2}) std::signal(signal, on_warning);
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
    const std::optional<std::set<size_t>> held = farm::held_pieces(job);
    std::vector<size_t> pieces;
    size_t held_count = 0;
    for (size_t i = 0; i < states->size(); ++i) {
        const farm::PieceState& s = (*states)[i];
        if (s.state == farm::State::Canceled) return end_of(job, false);
        if (s.state == farm::State::Done || s.state == farm::State::GaveUp) continue;
        // A task that the engine does not have any more is dead, whatever its file says
        const bool is_alive =
            s.state == farm::State::Running && (!held || s.attempts.back().task.empty());
        if (is_alive || (held && held->contains(i)))
            ++held_count;
        else
            pieces.push_back(i);
    }
    if (pieces.empty() && held_count > 0) {
        fmt::print("{} pieces wait or run already, with a merge behind them\n", held_count);
        return Done;
    }
    if (pieces.empty()) return end_of(job, false);
    const auto submitted = farm::submit_pieces(job, pieces);
    if (!submitted) return fail(submitted.error());
    fmt::print("{} pieces again; {}\n", pieces.size(), *submitted);
    return Done;
}

/// Gives further pieces to the engine, or ends the job.
int next_round(const farm::Job& given) {
    const Result<OutputLock> lock = lock_rounds(given);
    if (!lock) return fail(lock.error());
    // Another merge may have added pieces
    Result<farm::Job> job = farm::read_job(given.folder);
    if (!job) return fail(job.error());
    const auto round = farm::add_round(*job);
    if (!round) return fail(round.error());
    if (!round->empty()) fmt::print("{}\n", round_text(*job, *round));
    return resubmit(*job);
}

int run_merge(const TaskArguments& a) {
    const Result<farm::Job> job = farm::read_job(a.job);
    if (!job) return fail(job.error());
    const StopSignals signals;
    const TaskProgress progress(*job, a.progress == "openjd");
    if (const auto merged = farm::merge_frames(*job); !merged) {
        progress.fail(merged.error().message);
        return fail(merged.error());
    }
    const int code = a.resubmits ? next_round(*job) : end_of(*job, false);
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
    for (const std::string& line : farm::differing_processors(*checks))
        fmt::print("note: {}; the pixels {}\n", line,
                   lines.empty() ? "are the same" : "are compared above");
    if (!lines.empty()) return RenderError;
    fmt::print("{} ({}): {} machines checked, all alike\n", own->node, own->processor,
               checks->size());
    return Done;
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
    add_farm_submit(farm, run, start_job);
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
