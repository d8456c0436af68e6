// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

/// A file and the look that is mixed of it.
struct OpenedMix {
    std::string input;  ///< of a sequence, the file of `--frame`
    LayerStack stack;
    Look look;
};

/// The look that a command line asks for.
struct LookOptions {
    std::string preset, input_space;
    float exposure = 0;
    bool is_lenient = false;
    std::optional<double> frame;  ///< at which keys are read

    void add_to(Command& command);

    /// The preset with the controls after it, in the order typed. Errors: "bad-gain", "bad-matte",
    /// "bad-preset", those of read_file.
    Result<Look> look() const;

    /// The look at `--frame`. Errors: "no-frame" (it has keys and there is no frame).
    Result<Look> look_of_frame() const;

    /// The look at a frame of a sequence.
    Result<Look> look_at_frame(int frame_of_sequence) const;

    /// The file that is read: of a sequence, that of `--frame`. Errors: "no-frame",
    /// "frame-missing".
    Result<std::string> input_of_frame(const std::string& input) const;

    /// The input at `--frame`, and the look that fits it. Errors: those of look_of_frame(),
    /// input_of_frame() and LayerStack::load().
    Result<OpenedMix> open(const std::string& input) const;

    /// The look as it stands, or, with `--lenient`, without what the file lacks, which is printed.
    Look fitted(const LayerStack& stack, const Look& look) const;

  private:
    std::optional<Command> command_;
};

}  // namespace velatura::compositor::cli
