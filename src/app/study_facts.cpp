// SPDX-License-Identifier: Apache-2.0
#include "app/study_renderer.h"
#include "geometry/refinement.h"

#include <fmt/format.h>

namespace velatura::app {

namespace {

/// Values of the options that knobs turn.
std::map<std::string, std::string> values_now(const RenderArguments& a,
                                              const std::string& light_selection) {
    std::map<std::string, std::string> now = {
        {"--max-depth", fmt::format("{}", a.max_depth)},
        {"--roulette", a.roulette},
        {"--integrator", a.integrator},
        {"--light-selection", light_selection},
        {"--sampler", a.sampler},
        {"--adaptive", a.adaptive},
        {"--splitting", a.splitting},
        {"--guiding", a.guiding},
        {"--caustics", a.caustics},
        {"--filter", a.filter},
        {"--texture-bias", fmt::format("{:g}", a.texture_bias)},
        {"--volume-bounds", a.volume_bounds},
        {"--dicing-rate", fmt::format("{:g}", a.dicing_rate)},
        {"--effects", a.effects},
        {"--layers", a.layers},
    };
    // Other integrators stand for one way of light sampling
    if (a.integrator == "path")
        now["--light-sampling"] = a.light_sampling.empty() ? "mis" : a.light_sampling;
    if (a.subdivision_level) now["--subdivision-level"] = fmt::format("{}", *a.subdivision_level);
    if (a.accel == "bvh") now["--bvh-quality"] = a.bvh_quality;
    return now;
}

}  // namespace

Result<study::Facts> StudyRenderer::facts() {
    const Result<std::shared_ptr<const Prepared>> base = prepare("");
    if (!base) return base.error();
    const integrator::World& world = *(*base)->place->world;
    study::Facts facts;
    facts.now = values_now(job_.arguments, job_.light_selection_name);
    facts.spp = job_.settings.schedule.end_sample;
    if (world.chooses_lights) facts.holds.insert("several lights");
    if (!integrator::CausticSampler(world).is_empty()) facts.holds.insert("casters of caustics");
    if (!world.scene.textures.empty()) facts.holds.insert("textures");
    if (world.volumes) facts.holds.insert("volumes");
    if (geometry::first_subdivided(input_.scene))
        facts.holds.insert(job_.settings.world.dicing.level ? "subdivision by level"
                                                            : "subdivision by rate");
    for (size_t e = 0; e < scene::effect_count; ++e) {
        const scene::EffectInfo& info = scene::info(scene::Effect(e));
        const bool is_on = input_.plan.entries[e].state == integrator::EffectState::On;
        if (is_on && info.kind == scene::EffectKind::Scene && integrator::can_omit(info.effect))
            facts.effects.emplace_back(info.name);
    }
    return facts;
}

}  // namespace velatura::app
