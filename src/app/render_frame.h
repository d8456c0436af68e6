// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_job.h"
#include "base/diagnostics.h"
#include "integrator/effect_plan.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::app {

/// What a camera prim says of its lens.
struct CameraLens {
    std::string path;
    double focal_length = 50;   ///< as authored: tenths of a scene unit, or millimeters by `units`
    double f_stop = 0;          ///< 0: everything is in focus
    double focus_distance = 0;  ///< scene units
};

/// One frame of one scene.
struct FrameInput {
    explicit FrameInput(const scene::Scene& s) : scene(s) {}

    const scene::Scene& scene;
    integrator::EffectPlan plan;
    std::string output;
    std::vector<std::string> other_outputs;  ///< of products that share the samples
    std::string stats_file;                  ///< empty: no statistics are written
    std::string scene_name;                  ///< file name of the root layer, no folder
    uint64_t content_hash = 0;               ///< of every layer that took part
    std::vector<std::string> layer_names;
    std::vector<std::string> layer_files;           ///< where they are
    std::vector<layers::LightValues> light_values;  ///< of the light prims
    std::vector<CameraLens> cameras;                ///< of the stage, in its order
    double frame = 0;
    std::string up_axis = "Y";  ///< of the stage
    double open_s = 0, translate_s = 0;
};

/// Renders and writes one frame, with progress and interim images; prints what was written unless
/// quiet. Returns: an exit code of exit_codes.h.
int render_frame(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics);

}  // namespace velatura::app
