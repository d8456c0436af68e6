// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/camera.h"
#include "view/edits_layer.h"

namespace velatura::view {

/// Whether both see the same image.
bool is_same_camera(const scene::Camera& a, const scene::Camera& b);

/// Whether both look from the same place in the same direction; of orthographic cameras also
/// whether they see as much.
bool is_same_pose(const scene::Camera& a, const scene::Camera& b);

/// The lens of one camera where the other one is. Both are of one origin.
scene::Camera with_pose(const scene::Camera& lens, const scene::Camera& pose);

/// Opinions over the scene's camera prim: its transform in world space and its focus distance; of
/// an orthographic camera its apertures as well. A scene without a camera gets one that frames it:
/// /view_camera.
PrimEdit camera_edit(const scene::Camera& of_scene, const scene::Camera& edited);

}  // namespace velatura::view
