// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/deep_film.h"
#include "film/layer_set.h"
#include "integrator/caustics.h"
#include "integrator/effect_plan.h"
#include "integrator/firefly_trial.h"
#include "integrator/guide_training.h"
#include "integrator/path_tracer.h"
#include "integrator/render_options.h"
#include "integrator/world.h"
#include "scene/scene.h"

#include <optional>

namespace velatura::render {

/// Settings of a render, in addition to the scene's own RenderSettings (resolution, lens, shutter).
struct Settings {
    integrator::RenderOptions schedule = {};  ///< spp, seed, time budget, target error, tiles

    /// The Renderer fills in the results of the prepass, caustics and mattes; what is set here is
    /// used where no prepass runs.
    integrator::PathTracerOptions tracer = {};

    film::LayerSet layers = {};  ///< light layers of the file, see with_rows()

    /// Stores bounces up to the last one with this fraction of the light, at most
    /// layers.last_bounce. nullopt: all up to layers.last_bounce.
    std::optional<double> min_bounce_share = {};

    /// Chooses layers.clamp_indirect by a trial before the render; what it is set to before must be
    /// finite, so that layers have room for clamps. nullopt: layers.clamp_indirect as it is.
    std::optional<integrator::FireflyGuard> firefly_guard = {};

    /// width and height of 0 are those of the scene; 0 expected_rays is the schedule's.
    integrator::WorldOptions world = {};

    integrator::Guiding guiding = integrator::Guiding::Auto;
    integrator::Caustics caustics = integrator::Caustics::Auto;
    bool splits = true;  ///< path splitting where the prepass finds that it lowers the error
    std::optional<film::DeepOptions> deep = {};  ///< a deep image as well

    scene::EffectSet omitted = {};  ///< effects that are removed from the scene
    bool force_all = false;         ///< runs all effects, whether or not the scene uses them

    /// Data window [px]: origin top left, overscan allowed. nullopt: the whole image.
    std::optional<film::Window> window = {};
};

/// The layers, with light-group and shadow-caster rows for the scene's groups and casters, under
/// unique names, and with the layers of its catchers.
film::LayerSet with_rows(film::LayerSet layers, const scene::Scene& scene);

/// Plan: the effects that the scene uses. Removes those of Settings::omitted from the scene.
integrator::EffectPlan plan_effects(const Settings& settings, scene::Scene& scene);

}  // namespace velatura::render
