// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/frame_runs.h"

#include "base/frames.h"
#include "compositor/cli/command_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace velatura::compositor::cli {

namespace {

/// Frames between the first and the last whose file is not there.
std::vector<int> gaps_of(const std::vector<int>& frames) {
    constexpr size_t max_told = 1000;
    std::vector<int> gaps;
    for (size_t i = 1; i < frames.size(); ++i)
        for (int f = frames[i - 1] + 1; f < frames[i] && gaps.size() < max_told; ++f)
            gaps.push_back(f);
    return gaps;
}

const std::string& first_sequence(const FrameRuns& runs) {
    return *std::find_if(runs.inputs.begin(), runs.inputs.end(), is_sequence);
}

/// Of an input that has none for this frame; empty: all are there.
std::string missing_input(const FrameRuns& runs, const FrameNames& names) {
    for (const std::string& input : runs.inputs) {
        std::error_code failed;
        const std::string file = names.input(input);
        if (!file.empty() && is_sequence(input) && !std::filesystem::exists(file, failed))
            return file;
    }
    return {};
}

}  // namespace

std::string FrameNames::input(const std::string& name) const {
    return is_sequence_ ? frame_file(name, *frame_) : name;
}

std::string FrameNames::output(const std::string& name) const {
    if (!frame_ || (!is_sequence_ && !is_plainly_sequence(name))) return name;
    return frame_path(name, *frame_);
}

void add_frames_option(Command& command, std::string& frames) {
    command.add_option("--frames", frames, "Frames of a sequence, e.g. 1-100x2 or 1,5,9")
        .type_name("LIST")
        .default_text("all that exist");
}

Option add_stereo_option(Command& command, std::string& view) {
    return command
        .add_option("--stereo", view, "View of a stereo file: left, right, or a name of the file")
        .type_name("VIEW")
        .default_text("the first");
}

bool has_sequence(const FrameRuns& runs) {
    return std::any_of(runs.inputs.begin(), runs.inputs.end(), is_sequence);
}

Result<std::vector<int>> frames_of(const FrameRuns& runs) {
    const std::string& input = first_sequence(runs);
    for (const std::string& output : runs.outputs)
        if (!output.empty() && !is_sequence(output))
            return Error{
                "bad-output",
                fmt::format("{} is one file and {} a sequence; #### in it is the frame number",
                            output, input)};
    if (!runs.frames.empty()) {
        auto frames = parse_whole_frames(runs.frames);
        if (!frames) return Error{frames.error().code, "--frames: " + frames.error().message};
        return frames;
    }
    std::vector<int> frames = frames_on_disk(input);
    if (frames.empty()) return Error{"frame-missing", "no frame found of " + input};
    if (const auto gaps = gaps_of(frames); !gaps.empty())
        warn(fmt::format("{} has no frames {}", input, frame_list(gaps)));
    return frames;
}

int run_frames(const FrameRuns& runs, const std::function<int(const FrameNames&)>& run) {
    if (!has_sequence(runs)) {
        if (!runs.frames.empty())
            return report({"bad-frames", fmt::format("{} is one file: --frames needs #### in its "
                                                     "name",
                                                     runs.inputs.front())});
        return run(FrameNames(frame_in_name(runs.inputs.front()), false));
    }
    const auto frames = frames_of(runs);
    if (!frames) return report(frames.error());
    int code = done;
    for (const int frame : *frames) {
        const FrameNames names(frame, true);
        const std::string missing = missing_input(runs, names);
        const int one =
            missing.empty()
                ? run(names)
                : report({"frame-missing", fmt::format("frame {}: {} not found", frame, missing)});
        if (code == done) code = one;
    }
    return code;
}

}  // namespace velatura::compositor::cli
