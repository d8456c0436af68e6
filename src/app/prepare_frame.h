// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "app/scene_loader.h"

#include <functional>
#include <memory>
#include <vector>

namespace velatura::app {

/// A frame that can be rendered: its scene and what is known of it.
struct PreparedFrame {
    std::unique_ptr<const scene::Scene> scene;
    FrameInput input;  ///< refers to the scene
};

/// Time codes of --frames; empty: it is not given. Errors: "bad-frames".
Result<std::vector<double>> frames_of(const RenderArguments& arguments);

/// Translates one frame, reads its volumes, chooses its layers and its effects. Nothing is printed.
/// Args:   has_many: each of several frames has files of its own.
///         product: index among the settings' products, whose view is rendered.
/// Errors: those of translate_stage, "file-lost" (files changed while they were read), "strict",
///         "lpe" (usage: a wrong --lpe).
Result<PreparedFrame> prepare_frame(const RenderJob& job,
                                    const LoadedStage& loaded,
                                    double frame,
                                    bool has_many,
                                    Diagnostics& diagnostics,
                                    size_t product = 0);

/// What is done with a frame that is ready. Returns: an exit code of exit_codes.h.
using FrameFunction =
    std::function<int(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics)>;

/// Checks the options, opens the scene, and hands over one frame after the other, translated, with
/// its effect plan, and without the effects that are to be left out. Prints diagnostics as they
/// come. Returns: the worst exit code; a signal or wrong usage ends it at once.
int for_each_frame(const RenderArguments& arguments, const FrameFunction& use);

}  // namespace velatura::app
