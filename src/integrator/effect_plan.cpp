// SPDX-License-Identifier: Apache-2.0
#include "integrator/effect_plan.h"

#include "integrator/caustic_paths.h"
#include "integrator/effect_rules.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::integrator {

using scene::Effect;

namespace {

template <class Visitor>
void for_each_rule(Visitor visit) {
    for (const auto rules : {camera_rules(), geometry_rules(), surface_rules(), light_rules()})
        for (const EffectRule& rule : rules) visit(rule);
}

const EffectRule* rule_of(Effect effect) {
    const EffectRule* found = nullptr;
    for_each_rule([&](const EffectRule& rule) {
        if (rule.effect == effect) found = &rule;
    });
    return found;
}

EffectState state_of(scene::EffectNote::Kind kind) {
    return kind == scene::EffectNote::Kind::ProvenZero ? EffectState::ProvenZero
                                                       : EffectState::NotSimulated;
}

EffectEntry find(const scene::Scene& scene, const EffectRule& rule) {
    EffectFindings found(scene);
    if (rule.find) rule.find(found);
    for (const scene::EffectNote& note : scene.effect_notes)
        if (note.effect == rule.effect)
            found.add(state_of(note.kind), note.prim_path, note.why, note.prims);
    return found.entry;
}

/// Caustics that are found by other ways than camera paths.
EffectEntry caustic_entry(const scene::Scene& scene, Caustics caustics) {
    if (caustics == Caustics::Path) return {EffectState::Absent, {}, "--caustics", 0};
    if (caustics == Caustics::Manifold || caustics == Caustics::SmallLights) {
        const bool is_partial =
            std::any_of(scene.materials.begin(), scene.materials.end(), scene::is_dispersive);
        return {EffectState::On,
                {},
                is_partial ? "--caustics; paths find what dispersive solids refract" : "--caustics",
                1};
    }
    if (!CausticPaths::can_exist(scene))
        return {EffectState::Absent, {}, "no narrow lobes under a light but domes", 0};
    return {EffectState::On,
            {},
            caustics == Caustics::Auto ? "where trial paths predict a gain" : "--caustics",
            1};
}

std::string path_layers_text(const film::LayerSet& layers) {
    const size_t lobes = layers.lobes().size(), others = layers.path_layers.size() - lobes;
    std::string text;
    if (lobes > 0)
        text = fmt::format("{} groups x {} columns x {} lobes", layers.groups.size(),
                           layers.bounce_count(), lobes);
    if (others > 0)
        text +=
            fmt::format("{}{} layers of light path expressions", text.empty() ? "" : ", ", others);
    return text;
}

/// What the command line alone decides.
void add_options(const PlanOptions& o, EffectPlan& plan) {
    const auto set = [&](Effect e, bool is_on, std::string why) {
        plan.entries[size_t(e)] = {
            is_on ? EffectState::On : EffectState::Absent, {}, std::move(why), is_on ? 1u : 0u};
    };
    set(Effect::Roulette, has_chances_to_end(o.estimator.roulette),
        o.estimator.roulette == Roulette::Efficiency
            ? "by trial paths"
            : fmt::format("from bounce {} on", o.estimator.roulette_start));
    const bool is_tried = o.guiding == Guiding::Auto;
    set(Effect::Guiding, o.guiding != Guiding::Off,
        is_tried ? "where trial paths predict a gain" : "--guiding on");
    set(Effect::Splitting, o.splits, "where trial paths predict a gain");
    set(Effect::AdaptiveSampling, o.is_adaptive, "more samples in noisy pixels");
    const film::LayerSet& l = o.layers;
    set(Effect::BounceLayers, l.bounce_layers,
        fmt::format("one by one up to b{}, and tail", l.last_bounce));
    set(Effect::LightLayers, l.group_layers, fmt::format("{} groups", l.groups.size()));
    set(Effect::MatrixLayers, l.matrix_layers,
        fmt::format("{} groups x {} columns", l.groups.size(), l.bounce_count()));
    set(Effect::ShadowLayers, l.wants_unoccluded(), fmt::format("{} groups", l.groups.size()));
    set(Effect::CasterLayers, l.caster_layers, fmt::format("{} casters", l.casters.size()));
    set(Effect::ClampLayers, l.has_clamp(), "--clamp-direct or --clamp-indirect");
    set(Effect::PathLayers, !l.path_layers.empty(), path_layers_text(l));
    std::string data =
        l.data_layers ? "albedo N P Z st primId instanceId sampleCount variance" : "";
    for (const accumulate::DataLayer& d : l.named_data) data += (data.empty() ? "" : " ") + d.name;
    set(Effect::DataLayers, l.has_data(), std::move(data));
    set(Effect::HalfImages, l.halves, "two of every light layer");
    set(Effect::DeepSamples, o.is_deep, "--deep");
    set(Effect::IdMattes, l.has_mattes(), fmt::format("Cryptomattes of {} levels", l.matte_levels));
}

}  // namespace

const char* name_of(EffectState state) {
    switch (state) {
        case EffectState::Absent:
            return "absent";
        case EffectState::ProvenZero:
            return "proven zero";
        case EffectState::NotSimulated:
            return "not simulated";
        case EffectState::On:
            return "on";
        case EffectState::Omitted:
            return "left out";
    }
    return "";
}

size_t EffectPlan::count(EffectState state) const {
    return size_t(std::count_if(entries.begin(), entries.end(),
                                [&](const EffectEntry& e) { return e.state == state; }));
}

scene::EffectSet EffectPlan::forced() const {
    scene::EffectSet set;
    for (size_t i = 0; i < entries.size(); ++i)
        if (entries[i].is_forced) set.add(Effect(i));
    return set;
}

EffectPlan make_plan(const scene::Scene& scene, const PlanOptions& options) {
    EffectPlan plan;
    for_each_rule([&](const EffectRule& rule) {
        EffectEntry& entry = plan.entries[size_t(rule.effect)];
        entry = find(scene, rule);
        if (options.omitted.has(rule.effect) && entry.state == EffectState::On)
            entry.state = EffectState::Omitted;
        entry.is_forced = options.force_all && rule.is_forceable && entry.state < EffectState::On;
    });
    add_options(options, plan);
    plan.entries[size_t(Effect::CausticSearch)] = caustic_entry(scene, options.caustics);
    if (plan.of(Effect::NestedDielectrics).state == EffectState::On &&
        plan.of(Effect::CausticSearch).state == EffectState::On)
        plan.entries[size_t(Effect::CausticSearch)].why +=
            "; not by solids, some of which have dielectric priorities";
    return plan;
}

bool is_forceable(Effect effect) {
    const EffectRule* rule = rule_of(effect);
    return rule && rule->is_forceable;
}

bool can_omit(Effect effect) {
    const EffectRule* rule = rule_of(effect);
    return rule && rule->omit;
}

void omit(scene::Scene& scene, Effect effect) {
    rule_of(effect)->omit(scene);
}

std::vector<Effect> broken_promises(const EffectPlan& plan, const scene::EffectCalls& calls) {
    std::vector<Effect> broken;
    for (size_t i = 0; i < plan.entries.size(); ++i)
        if (calls.count[i] > 0 && !plan.entries[i].can_run()) broken.push_back(Effect(i));
    return broken;
}

void EffectFindings::add(EffectState state,
                         std::string_view prim,
                         std::string_view why,
                         uint64_t prims) {
    const bool is_left = state == EffectState::NotSimulated && entry.state > state;
    if (is_left || (entry.state == EffectState::NotSimulated && state > entry.state))
        entry.not_simulated_prims += is_left ? prims : entry.prims;
    if (state == entry.state) entry.prims += prims;
    if (state <= entry.state) return;
    entry.state = state;
    entry.prim = prim;
    entry.why = why;
    entry.prims = prims;
}

std::string_view EffectFindings::prim_of(scene::ProvenanceId id) const {
    return id < scene.provenance.size() ? std::string_view(scene.provenance[id].prim_path)
                                        : std::string_view();
}

}  // namespace velatura::integrator
