// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/camera.h"
#include "translate/context/context.h"

namespace velatura::translate {

/// Camera of a UsdGeomCamera prim for the image that ctx.scene.settings asks for; "bad-camera"
/// when its transform or lens cannot form an image.
Result<scene::Camera> read_camera(Context& ctx, Prim prim);

/// Camera that sees the whole box (world space) from above and beside, field of view as a
/// UsdGeomCamera without opinions.
scene::Camera framing_camera(Context& ctx, const Box3d& world_bounds);

}  // namespace velatura::translate
