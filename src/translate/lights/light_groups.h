// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"
#include "translate/context/context.h"
#include "translate/lights/light_grouping.h"

namespace velatura::translate::lights {

/// State of this module: how lights are grouped, by default one row for each.
struct GroupingPolicy {
    LightGrouping grouping = LightGrouping::PerLight;
};

/// Dome of radiance 1 in the group `default`.
void add_default_dome(Context& ctx);
/// Appends `emissive`, names `is_environment` and checks that names are unique.
void finish_light_groups(Context& ctx);
/// Row of the light, created on first use, which then lists its prim.
scene::GroupId join_light_group(Context& ctx, Prim light);

}  // namespace velatura::translate::lights
