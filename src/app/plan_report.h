// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/image_needs.h"
#include "app/render_frame.h"
#include "integrator/effect_plan.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::app {

/// What a render needs beside time, told before it begins.
struct PlanNeeds {
    struct Plugin {
        std::string name;
        bool is_opened = false;
        std::string why;
    };

    std::vector<Plugin> plugins;
    std::string plugin_folders;  ///< searched, for people
    bool is_before_refinement =
        false;  ///< geometry and tree are those of the cages, which will be cut finer
    uint64_t geometry_bytes = 0;     ///< as it will be
    uint64_t accelerator_bytes = 0;  ///< expected
    uint64_t film_bytes = 0;         ///< expected
    uint64_t splat_bytes = 0;        ///< expected, of light tracing if it is used
    uint64_t writing_bytes = 0;      ///< expected, while the image is written
    uint64_t volume_bytes = 0;       ///< grids, which are read before the plan
    uint64_t triangles = 0, instances = 0;
    std::vector<ImageNeeds::File> files;
};

/// Effects with state, prim and reason, for the header string velatura/plan. The same for every
/// number of threads.
nlohmann::ordered_json plan_json(const integrator::EffectPlan& plan,
                                 const std::vector<scene::Effect>& broken = {});

/// plan_json() and what one call of an effect is, with how many there were.
nlohmann::ordered_json effect_calls_json(const integrator::EffectPlan& plan,
                                         const scene::EffectCalls& calls);

nlohmann::ordered_json needs_json(const PlanNeeds& needs);

/// Tables for people; effects that are absent are named in one line unless `verbose`.
std::string plan_text(const integrator::EffectPlan& plan, bool verbose);
std::string needs_text(const PlanNeeds& needs);

/// Those that the render opens if they are there, by the manifests of the plugin folders.
std::vector<PlanNeeds::Plugin> expected_plugins(const RenderJob& job,
                                                const FrameInput& input,
                                                Diagnostics& diagnostics);

/// Looks at the scene's geometry, the layers and the manifests of plugins; opens none of them.
PlanNeeds plan_needs(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics);

}  // namespace velatura::app
