// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

#include <cstdint>
#include <string_view>
#include <vector>

namespace velatura::translate::lights {

/// State of this module: the lights that were found.
struct CollectedLights {
    /// A light as often as it is placed.
    struct Placed {
        Prim prim;
        uint32_t place = 0;  ///< where it stands, for light linking
    };

    std::vector<Placed> placed;     ///< of Scene::lights
    std::vector<Prim> mesh_lights;  ///< of Scene::mesh_lights
    bool has_prim = false;          ///< a light was met, whether it shines or not
};

bool is_light_type(std::string_view type);
/// Whether a light of the type is at a place, not at infinity.
bool has_place(std::string_view type);
/// How far a light reaches from its origin, in its own space, about.
double reach_of_light(Context& ctx, Prim prim);
/// Whether the prim is a light, be it of a kind that is not rendered.
bool is_any_light(Prim prim);
/// Light of the prim, appended to Scene::lights and groups. later: keys of its motion, see
/// scene::Light. place: where it stands, kept in CollectedLights. False when it emits nothing.
bool read_light(Context& ctx,
                const LightSite& site,
                const Mat4d& render_from_light,
                std::vector<Mat4d> later,
                uint32_t place);

}  // namespace velatura::translate::lights
