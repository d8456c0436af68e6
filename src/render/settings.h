// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/deep_film.h"
#include "film/layer_set.h"
#include "integrator/caustics.h"
#include "integrator/effect_plan.h"
#include "integrator/guide_training.h"
#include "integrator/path_tracer.h"
#include "integrator/render_options.h"
#include "integrator/world.h"
#include "scene/scene.h"

#include <optional>

namespace velatura::render {

/// How a scene is rendered, beside what its own RenderSettings say (size, lens, shutter).
struct Settings {
    integrator::RenderOptions schedule = {};

    /// What trials find, caustics and mattes are filled in by the Renderer; what is set here stays
    /// where no trial runs.
    integrator::PathTracerOptions tracer = {};

    film::LayerSet layers = {};  ///< with the rows of the light mixer, see with_rows()

    /// layers.last_bounce is the most, and the last bounce that has this share of the light is
    /// stored. Nothing: all up to layers.last_bounce.
    std::optional<double> least_bounce_share = {};

    /// Where width and height are 0 they come from the scene, and expected_rays from the schedule.
    integrator::WorldOptions world = {};

    integrator::Guiding guiding = integrator::Guiding::Auto;
    integrator::Caustics caustics = integrator::Caustics::Path;
    bool splits = true;  ///< paths divide where trial paths say that it pays
    std::optional<film::DeepOptions> deep = {};  ///< a deep picture as well

    scene::EffectSet left_out = {};  ///< effects that are taken out of the scene
    bool force_all = false;          ///< effects run though the scene does not call for them

    /// The pixels to render; origin top left, may reach beyond the picture. Nothing: the picture.
    std::optional<film::Window> window = {};
};

/// The layers with a row for each light group and caster of the scene, and names that no two share.
film::LayerSet with_rows(film::LayerSet layers, const scene::Scene& scene);

/// What the scene calls for. Effects of Settings::left_out are taken out of it.
integrator::EffectPlan plan_effects(const Settings& settings, scene::Scene& scene);

}  // namespace velatura::render
