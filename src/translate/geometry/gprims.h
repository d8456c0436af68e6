// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"
#include "translate/context/context.h"

#include <optional>
#include <string_view>

namespace velatura::translate::geometry {

/// Shape of a Sphere, Cube, Cylinder, Cone, Capsule or Plane prim; nullopt when its sizes make no
/// surface.
std::optional<scene::Shape> read_gprim(Context& ctx, Prim prim, const Mat4d& matrix);
bool is_gprim_type(std::string_view type);

}  // namespace velatura::translate::geometry
