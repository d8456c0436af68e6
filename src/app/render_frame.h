// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/effect_choice.h"
#include "app/progress.h"
#include "app/render_arguments.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "geometry/dicing.h"
#include "integrator/branch_trial.h"
#include "integrator/caustics.h"
#include "integrator/effect_plan.h"
#include "integrator/guide_training.h"
#include "integrator/path_tracer.h"
#include "integrator/render_options.h"
#include "integrator/roulette_trial.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// The command line of a render, checked and with the scene's own settings filled in; the same for
/// every frame.
struct RenderJob {
    /// The samples are a bound that nobody typed: time or error ends the render.
    bool is_open_ended = false;
    RenderArguments arguments;
    integrator::RenderOptions schedule;
    integrator::PathTracerOptions tracer;
    film::LayerSet layers;  ///< without groups
    /// Of --bounces auto: layers.last_bounce is the most, and the last bounce with this share of
    /// the light is stored.
    std::optional<double> least_bounce_share;
    std::string light_sampling = "mis";  ///< as the option names it
    std::string light_selection_name = "tree";
    lights::SelectionKind light_selection = lights::SelectionKind::Tree;
    bool samples_light_area = false;                         ///< see integrator::WorldOptions
    const accel::AcceleratorFactory* accelerator = nullptr;  ///< nullptr = the own BVH
    geometry::DicingOptions dicing;
    std::optional<accel::BvhQuality> bvh_quality =
        {};  ///< by default chosen by the expected number of rays
    integrator::Guiding guiding = integrator::Guiding::Auto;
    bool splits = true;  ///< paths divide where trial paths say that it pays
    integrator::Caustics caustics = integrator::Caustics::Path;
    EffectChoice effects;
    image::Layout layout = image::Layout::MultiPart;
    image::Compression compression = image::Compression::Zip;
    std::optional<film::DeepOptions> deep = {};  ///< a deep picture as well
    ProgressStyle progress = ProgressStyle::Bar;
    std::optional<std::array<uint64_t, 3>> replay;  ///< x, y, sample
};

/// Whether files hold the exact sums: to be merged, or gone on from.
bool keeps_sums(const RenderJob& job);

/// Checks values and combinations of options. Errors: "usage" (exit 2).
Result<RenderJob> make_render_job(const RenderArguments& arguments);

/// Whether the name ends in .exr, in whatever case: the only format a render is written in.
bool has_exr_extension(const std::string& path);

/// One frame of one scene.
struct FrameInput {
    explicit FrameInput(const scene::Scene& s) : scene(s) {}

    const scene::Scene& scene;
    integrator::EffectPlan plan;
    std::string output;
    std::string stats_file;     ///< empty: no statistics are written
    std::string scene_name;     ///< file name of the root layer, no folder
    uint64_t content_hash = 0;  ///< of every layer that took part
    std::vector<std::string> layer_names;
    std::vector<image::LightValues> light_values;  ///< of the light prims
    double frame = 0;
    double open_s = 0, translate_s = 0;
};

/// Renders and writes one frame, with progress and interim pictures; prints what was written unless
/// quiet. Returns: an exit code of exit_codes.h.
int render_frame(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics);

}  // namespace velatura::app
