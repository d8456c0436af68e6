// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/result.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

/// The files of one run of a command: those that were typed or, where inputs are sequences, those
/// of a frame.
class FrameNames {
  public:
    FrameNames(std::optional<int> frame, bool is_sequence)
        : frame_(frame), is_sequence_(is_sequence) {}

    /// Of the sequence.
    std::optional<int> frame() const { return is_sequence_ ? frame_ : std::nullopt; }

    std::string input(const std::string& name) const;
    /// A pattern gets the frame of a single input too, if that one's name tells it.
    std::string output(const std::string& name) const;

  private:
    std::optional<int> frame_;
    bool is_sequence_ = false;
};

/// What a command was given; empty names are none.
struct FrameRuns {
    std::vector<std::string> inputs, outputs;
    std::string frames;  ///< --frames; empty = all that are there
};

void add_frames_option(Command& command, std::string& frames);

/// --stereo: which view of a file is read.
Option add_stereo_option(Command& command, std::string& view);

/// True where an input is a sequence.
bool has_sequence(const FrameRuns& runs);

/// Frames of the first input that is a sequence, without those that are not there; warns of gaps.
/// Errors: "bad-frames", "bad-output" (an output that is the same for all), "frame-missing".
Result<std::vector<int>> frames_of(const FrameRuns& runs);

/// Calls `run` once, or once for each frame, whatever becomes of the others. Returns: the first
/// exit code that is not 0.
int run_frames(const FrameRuns& runs, const std::function<int(const FrameNames& names)>& run);

}  // namespace velatura::compositor::cli
