// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/camera.h"

namespace velatura::view {

/// Cameras made from a camera by the moves of a hand. Points and boxes are in render space; keys of
/// a camera that moves by itself move along. Angles in degrees.

/// Where the camera is, and its unit axes.
Vec3d position_of(const scene::Camera& camera);
Vec3d right_of(const scene::Camera& camera);
Vec3d up_of(const scene::Camera& camera);
Vec3d forward_of(const scene::Camera& camera);

/// The axis that the scene stands on, as far as its camera shows: of ±Y and ±Z the one nearest to
/// the camera's up.
Vec3d nearest_up(const scene::Camera& camera);

/// Around the pivot: by `yaw` about `up`, then by `pitch` about the right; positive moves the
/// camera to the left and up, as dragging the scene to the right and down does. It does not tip
/// over the poles.
scene::Camera orbit(
    const scene::Camera& camera, const Vec3d& pivot, const Vec3d& up, double yaw, double pitch);

/// Along its own axes [scene units].
scene::Camera pan(const scene::Camera& camera, double right, double up);

/// The distance to the pivot times `factor`; of an orthographic camera the image window.
scene::Camera dolly(const scene::Camera& camera, const Vec3d& pivot, double factor);

/// In the same direction, with the box as large as the image allows. An empty box: the same camera.
scene::Camera frame(const scene::Camera& camera, const Box3d& box);

}  // namespace velatura::view
