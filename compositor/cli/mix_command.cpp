// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/io/image_name.h"
#include "compositor/io/image_storage.h"
#include "compositor/io/input_files.h"
#include "compositor/mix/mix_job.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct MixOptions {
    std::vector<std::string> inputs;
    std::string output, save_preset, display, view, stereo, frames, plate;
    LookOptions look;
    ImageStorageOptions storage;
    double memory_gb = 4;
    bool with_layers = false, is_strict = false, is_quiet = false;
};

/// A bar on a terminal, a line per frame elsewhere.
class FrameProgress {
  public:
    FrameProgress(size_t total, bool is_quiet)
        : total_(total), is_quiet_(is_quiet), is_terminal_(isatty(STDERR_FILENO) == 1) {}

    void report_frame(const mix::FrameOutcome& outcome) {
        ++done_;
        if (is_terminal_ && !is_quiet_) fmt::print(stderr, "\r{:79}\r", "");
        for (const std::string& warning : outcome.warnings) warn(warning);
        if (outcome.error) {
            const int code = report(*outcome.error);
            if (code_ == done) code_ = code;
            if (outcome.error->code == "frame-missing") missing_.push_back(outcome.frame);
        }
        if (is_quiet_) return;
        if (is_terminal_) {
            bar();
        } else if (!outcome.error) {
            fmt::print("{} ({} of {})\n", outcome.output, done_, total_);
            std::fflush(stdout);
        }
    }

    /// Exit code: that of the first error.
    int finish() const {
        if (is_terminal_ && !is_quiet_) fmt::print(stderr, "\n");
        if (!missing_.empty())
            report({"frame-missing", fmt::format("{} of {} frames are missing: {}", missing_.size(),
                                                 total_, frame_list(missing_))});
        return code_;
    }

  private:
    void bar() const {
        constexpr size_t width = 30;
        const size_t full = total_ == 0 ? width : width * done_ / total_;
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
        const double left = elapsed.count() / double(done_) * double(total_ - done_);
        fmt::print(stderr, "\r[{}{}] {} of {} frames, {:.0f} s | {:.0f} s left ",
                   std::string(full, '#'), std::string(width - full, '.'), done_, total_,
                   elapsed.count(), left);
        std::fflush(stderr);
    }

    size_t total_ = 0, done_ = 0;
    bool is_quiet_ = false, is_terminal_ = false;
    int code_ = done;
    std::vector<int> missing_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

FrameRuns runs_of(const MixOptions& o) {
    return {o.inputs, {o.output}, o.frames};
}

void warn_of_memory(const mix::MixJob& job, const mix::MemoryShare& share) {
    if (share.frame_bytes > job.memory_bytes)
        warn(fmt::format("{} needs about {:.1f} GB, above --memory",
                         has_sequence({job.inputs, {}, {}}) ? "a frame" : job.inputs[0],
                         double(share.frame_bytes) * 0x1p-30));
}

int mix_frames(const MixOptions& o, const mix::MixJob& job) {
    if (o.look.frame) return report({"bad-frames", "--frame needs a single file, not a sequence"});
    const auto frames = frames_of(runs_of(o));
    if (!frames) return report(frames.error());
    warn_of_memory(job, mix::share_memory(job, *frames));
    FrameProgress progress(frames->size(), o.is_quiet);
    mix::mix_sequence(job, *frames,
                      [&](const mix::FrameOutcome& outcome) { progress.report_frame(outcome); });
    return progress.finish();
}

int mix_file(const MixOptions& o, const mix::MixJob& job) {
    const mix::MemoryShare share = mix::share_memory(job, {0});
    warn_of_memory(job, share);
    return run_frames(runs_of(o), [&](const FrameNames& names) {
        const bool has_frame = o.look.frame && is_plainly_sequence(o.output);
        const std::string output =
            has_frame ? frame_path(o.output, *o.look.frame) : names.output(o.output);
        const auto mixed = mix::mix_one(job, o.inputs, output, o.look.frame,
                                        std::min(share.strip_bytes, job.memory_bytes / 4), o.plate);
        if (!mixed) return report(mixed.error());
        for (const std::string& warning : *mixed) warn(warning);
        return int(done);
    });
}

int run_mix(const MixOptions& o) {
    const auto storage = o.storage.storage(o.output);
    if (!storage) return report(storage.error());
    if (o.with_layers && !is_exr(o.output))
        return report({"bad-output", "--with-layers needs an .exr, which " + o.output + " is not"});
    if (o.with_layers && storage->type == image::ChannelType::Half)
        return report({"bad-output",
                       "--with-layers keeps the types of the file: as halves the layers would no "
                       "longer add up to the mix; remove --depth half"});
    if (o.with_layers && !o.plate.empty())
        return report({"bad-output",
                       "--with-layers and --plate cannot be combined: no layers add up to an image "
                       "with its plate"});
    auto look = o.look.look();
    if (!look) return report(look.error());
    if (!o.display.empty()) look->display = o.display;
    if (!o.view.empty()) look->view = o.view;
    if (are_frames(o.inputs))
        return report({"bad-frames",
                       fmt::format("{} and {} look like frames of one sequence, several files are "
                                   "AOVs of one image: name the frames by one ####",
                                   o.inputs[0], o.inputs[1])});
    mix::MixJob job;
    job.inputs = o.inputs;
    job.view = o.stereo;
    job.output = o.output;
    job.look = *look;
    job.plate = o.plate;
    job.with_layers = o.with_layers;
    job.storage = *storage;
    job.is_lenient = o.look.is_lenient;
    job.is_strict = o.is_strict;
    job.memory_bytes = size_t(o.memory_gb * 0x1p30);
    const int code = has_sequence(runs_of(o)) ? mix_frames(o, job) : mix_file(o, job);
    if (code != done || o.save_preset.empty()) return code;
    const auto saved = write_file_atomically(o.save_preset, look_to_json(*look));
    return saved ? int(done) : report(saved.error());
}

}  // namespace

void add_mix_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<MixOptions>();
    Command command =
        app.add_subcommand("mix", "Mix light layers: gain, tint, mute, solo, shadow lift");
    command
        .add_option(
            "input", o->inputs,
            "File of light layers, or shot.####.exr. EXR of another renderer: each layer.RGB "
            "is a row, and `rest` is the beauty minus these. Several files of one AOV each "
            "are one mix, with rows named by where the file names differ")
        .required()
        .reads();
    command
        .add_option(
            "-o,--output", o->output,
            "Output file: scene-linear .exr, or .png, .jpg, .tif or .dpx through OpenColorIO")
        .required()
        .writes();
    o->look.add_to(command);
    command.add_option("--save-preset", o->save_preset, "Preset file to write, JSON")
        .type_name("FILE")
        .writes();
    command
        .add_option(
            "--plate", o->plate,
            "Scene-linear .exr of the same size, or plate.####.exr, to lay the mix over: the "
            "layers of catchers put their shadows and reflections on it")
        .type_name("FILE")
        .reads();
    add_stereo_option(command, o->stereo);
    command.add_option("--display", o->display, "OpenColorIO display, except for .exr")
        .type_name("NAME");
    command
        .add_option("--view", o->view,
                    "OpenColorIO view, except for .exr: ACES, sRGB or Raw in the built-in config")
        .type_name("NAME");
    o->storage.add_to(command);
    command.add_flag(
        "--with-layers", o->with_layers,
        "Store all layers in the .exr too: light layers with their gains, shadow layers without "
        "the lifted part, data and Cryptomattes bit for bit");
    add_frames_option(command, o->frames);
    command
        .add_option("--memory", o->memory_gb,
                    "Memory for mixing in GB; decides how many frames of a sequence are mixed at "
                    "once")
        .range(0.1, 4096.0);
    command.add_flag("--strict", o->is_strict,
                     "Reject NaN and infinite values (exit code 4) instead of reading them as 0");
    command.add_flag("-q,--quiet", o->is_quiet, "Print no progress");
    command.example("velatura-comp mix shot.exr -o shot.png --gain key=+1.5st --gain indirect=2");
    command.callback([&run, o] { run = [o] { return run_mix(*o); }; });
}

}  // namespace velatura::compositor::cli
