// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"
#include "translate/context/context.h"
#include "translate/context/instance_source.h"

#include <vector>

namespace velatura::translate::lights {

/// Whether LightAPI or MeshLightAPI makes a light of the prim's geometry.
bool is_geometry_light(Prim prim);
/// Makes the shape of a prim a light, if it can be one. The group is left to be joined once the
/// shape is placed. site: how the prim stands in the space of the shape.
void make_mesh_light(Context& ctx, const LightSite& site, scene::Shape& shape);
/// Gives the lights among shapes that enter the scene their rows.
void join_mesh_light_groups(Context& ctx, const std::vector<scene::Shape>& shapes);

}  // namespace velatura::translate::lights
