// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context.h"

#include <cstdint>
#include <vector>

namespace velatura::translate {

/// Notes whether the light's collections lightLink and shadowLink say more than "everything", so
/// that places of instances are kept. Returns it.
bool note_linking(Context& ctx, Prim light);

/// UsdLuxShadowAPI, but for shadow:enable, which link_all() reads.
scene::LightLinks read_shadow(Context& ctx, Prim light);

/// Where the prototype of a placement stands that itself stands at `outer`, index into
/// ctx.link_places; 0 when nothing is linked.
uint32_t place_inside(Context& ctx, uint32_t outer, const Placement& placement);

/// Paths that what was placed there goes by: its own below the instance that brings it, then those
/// of its point instancers, the innermost first.
std::vector<usd::layer::Path> places_of(const Context& ctx,
                                        uint32_t place,
                                        scene::ProvenanceId provenance);

/// Evaluates the collections of all lights for all geometry that was placed: fills Scene::linking
/// and what refers to it. Membership is by path; geometry of a native instance goes by its path
/// below that instance, geometry of a point instancer by that of its prim and, where no rule covers
/// that, by that of the instancer.
void link_all(Context& ctx);

}  // namespace velatura::translate
