// SPDX-License-Identifier: Apache-2.0
#include "render/settings.h"

#include <string>
#include <utility>

namespace velatura::render {

namespace {

/// `catcher` and `plate`, and both of each light group.
void add_catcher_layers(film::LayerSet& layers) {
    using accumulate::DataSource;
    const auto add = [&layers](DataSource source, const std::string& group) {
        accumulate::DataLayer layer;
        layer.name = std::string(accumulate::name_of(source));
        if (!group.empty()) layer.name += "_" + group;
        layer.group = group;
        layer.source = source;
        layer.suffixes = accumulate::suffixes_of(source);
        layer.is_premultiplied = true;
        layers.named_data.push_back(std::move(layer));
    };
    add(DataSource::Catcher, "");
    add(DataSource::Plate, "");
    if (layers.groups.size() < 2) return;
    for (const film::LightGroup& group : layers.groups) {
        add(DataSource::Catcher, group.name);
        add(DataSource::Plate, group.name);
    }
}

}  // namespace

film::LayerSet with_rows(film::LayerSet layers, const scene::Scene& scene) {
    for (const scene::LightGroup& g : scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment, g.label});
    if (layers.caster_layers)
        for (const scene::Caster& c : scene.casters.list)
            layers.casters.push_back({c.name, c.prim});
    layers.normalize_names();
    std::erase_if(layers.named_data, [](const auto& d) { return d.is_of_catchers(); });
    if (scene.linking.catchers != scene::none) add_catcher_layers(layers);
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
