// SPDX-License-Identifier: Apache-2.0
#include "translate/unsupported.h"

#include "translate/lights/lights.h"
#include "translate/lights/mesh_lights.h"

#include <fmt/format.h>

namespace velatura::translate {

void warn_unsupported(Context& ctx, Prim prim) {
    const std::string& type = prim.type_name().str();
    if (type == "PortalLight") return;  // read with the dome that it belongs to
    if (prim.is_a("Curves")) ctx.note_not_simulated(scene::Effect::Curves, prim, type);
    if (prim.is_a("Points")) ctx.note_not_simulated(scene::Effect::Points, prim, type);
    const bool is_shown = prim.is_a("Gprim");
    const bool is_light = lights::is_any_light(prim);
    if (is_shown || is_light) {
        ctx.warn(is_light ? "unsupported-light" : "unsupported-geometry", prim,
                 fmt::format("{} is not supported, the prim is skipped", type));
    }
}

void warn_light_without_geometry(Context& ctx, Prim prim) {
    if (!lights::is_any_light(prim)) return;
    ctx.warn("unsupported-light", prim,
             "LightAPI needs a prim with geometry, and this prim has none; it emits nothing");
}

void warn_round_light(Context& ctx, Prim prim) {
    if (!lights::is_geometry_light(prim)) return;
    ctx.state<lights::CollectedLights>().has_prim = true;
    ctx.warn(
        "unsupported-light", prim,
        fmt::format("{} cannot be a light; only its material is rendered", prim.type_name().str()));
}

void warn_unsupported_features(Context& ctx, Prim prim) {
    if (prim.has_api("VolumeLightAPI"))
        ctx.warn("unsupported-light", prim,
                 "VolumeLightAPI is not supported; only the volume itself is rendered");
}

}  // namespace velatura::translate
