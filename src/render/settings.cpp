// SPDX-License-Identifier: Apache-2.0
#include "render/settings.h"

#include <utility>

namespace velatura::render {

film::LayerSet with_rows(film::LayerSet layers, const scene::Scene& scene) {
    for (const scene::LightGroup& g : scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment, g.label});
    if (layers.caster_layers)
        for (const scene::Caster& c : scene.casters.list)
            layers.casters.push_back({c.name, c.prim});
    layers.normalize_names();
    return layers;
}

integrator::EffectPlan plan_effects(const Settings& settings, scene::Scene& scene) {
    integrator::PlanOptions options;
    options.layers = settings.layers;
    options.estimator = settings.tracer.estimator;
    options.guiding = settings.guiding;
    options.caustics = settings.caustics;
    options.splits = settings.splits;
    options.is_adaptive = settings.schedule.adaptive;
    options.is_deep = settings.deep.has_value();
    options.omitted = settings.omitted;
    options.force_all = settings.force_all;
    integrator::EffectPlan plan = integrator::make_plan(scene, options);
    for (size_t i = 0; i < scene::effect_count; ++i)
        if (plan.entries[i].state == integrator::EffectState::Omitted)
            integrator::omit(scene, scene::Effect(i));
    return plan;
}

}  // namespace velatura::render
