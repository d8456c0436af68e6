// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/render_settings.h"

#include "integrator/caustics.h"

#include <pxr/base/tf/diagnostic.h>
#include <pxr/imaging/hd/tokens.h>

#include <algorithm>
#include <optional>
#include <set>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

const TfToken seed_name("velatura:seed"), depth_name("velatura:maxDepth"),
    bounces_name("velatura:bounces"), space_name("velatura:workingSpace"),
    caustics_name("velatura:caustics"), guiding_name("velatura:guiding"),
    splits_name("velatura:splitting"), adaptive_name("velatura:adaptive"),
    clamp_direct_name("velatura:clampDirect"), clamp_indirect_name("velatura:clampIndirect");

std::optional<integrator::Guiding> guiding_mode(const std::string& name) {
    using integrator::Guiding;
    if (name == "off") return Guiding::Off;
    if (name == "auto") return Guiding::Auto;
    if (name == "on") return Guiding::On;
    return std::nullopt;
}

void report_once(const TfToken& name, const std::string& value, const char* expected) {
    static std::set<std::string> reported;
    if (reported.insert(name.GetString() + value).second)
        TF_WARN("velatura: render setting %s is \"%s\", expected %s; auto is used", name.GetText(),
                value.c_str(), expected);
}

int at_least(int value, int min) {
    return std::max(value, min);
}

}  // namespace

HdRenderSettingDescriptorList setting_descriptors() {
    const HostSettings fallback;
    return {
        {"Samples per pixel", HdRenderSettingsTokens->convergedSamplesPerPixel,
         VtValue(fallback.spp)},
        {"Seed", seed_name, VtValue(fallback.seed)},
        {"Maximum depth (0: unlimited)", depth_name, VtValue(fallback.max_depth)},
        {"Bounces with a layer", bounces_name, VtValue(fallback.bounces)},
        {"Working space (lin_rec709, acescg, lin_rec2020, lin_p3d65, lin_adobergb, aces2065-1)",
         space_name, VtValue(fallback.working_space)},
        {"Caustics (path, manifold, small-lights, light, auto)", caustics_name,
         VtValue(fallback.caustics)},
        {"Path guiding (off, auto, on)", guiding_name, VtValue(fallback.guiding)},
        {"Path splitting", splits_name, VtValue(fallback.splits)},
        {"Adaptive sampling", adaptive_name, VtValue(fallback.adaptive)},
        {"Clamp of direct light (0: none)", clamp_direct_name, VtValue(fallback.clamp_direct)},
        {"Clamp of indirect light (0: none)", clamp_indirect_name,
         VtValue(fallback.clamp_indirect)},
    };
}

HostSettings read_settings(const HdRenderDelegate& delegate) {
    HostSettings host;
    const auto read = [&delegate](const TfToken& name, auto& value) {
        value = delegate.GetRenderSetting(name, value);
    };
    read(HdRenderSettingsTokens->convergedSamplesPerPixel, host.spp);
    read(seed_name, host.seed);
    read(depth_name, host.max_depth);
    read(bounces_name, host.bounces);
    read(space_name, host.working_space);
    read(caustics_name, host.caustics);
    read(guiding_name, host.guiding);
    read(splits_name, host.splits);
    read(adaptive_name, host.adaptive);
    read(clamp_direct_name, host.clamp_direct);
    read(clamp_indirect_name, host.clamp_indirect);
    host.spp = at_least(host.spp, 1);
    host.seed = at_least(host.seed, 0);
    host.max_depth = at_least(host.max_depth, 0);
    host.bounces = std::clamp(host.bounces, 0, 64);
    if (!integrator::caustics_mode(host.caustics)) {
        report_once(caustics_name, host.caustics, "path, manifold, small-lights, light or auto");
        host.caustics = "auto";
    }
    if (!guiding_mode(host.guiding)) {
        report_once(guiding_name, host.guiding, "off, auto or on");
        host.guiding = "auto";
    }
    return host;
}

render::Settings to_settings(const HostSettings& host) {
    render::Settings settings;
    settings.schedule.end_sample = uint64_t(host.spp);
    settings.schedule.seed = settings.tracer.seed = uint64_t(host.seed);
    settings.schedule.max_depth = settings.tracer.max_depth = host.max_depth;
    settings.schedule.adaptive = host.adaptive;
    settings.layers.last_bounce = host.bounces;
    if (host.clamp_direct > 0) settings.layers.clamp_direct = host.clamp_direct;
    if (host.clamp_indirect > 0) settings.layers.clamp_indirect = host.clamp_indirect;
    settings.caustics = *integrator::caustics_mode(host.caustics);
    settings.guiding = *guiding_mode(host.guiding);
    settings.splits = host.splits;
    return settings;
}

}  // namespace velatura::hydra
