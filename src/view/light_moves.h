// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "image/window.h"
#include "scene/camera.h"

#include <array>
#include <optional>

namespace velatura::view {

/// What a hand does to lights in the image. Points are in render space, pixels are those of the
/// image.

/// Where a point is seen; none: behind the camera.
std::optional<std::array<double, 2>> pixel_of(const scene::Camera& camera,
                                              const image::Window& frame,
                                              const Vec3d& point);

/// How far along the unit `axis` a point at `from` goes when the mouse moves by so many pixels: as
/// far as its image follows the mouse. 0 for an axis that is seen from its end.
double distance_along(const scene::Camera& camera,
                      const image::Window& frame,
                      const Vec3d& from,
                      const Vec3d& axis,
                      const std::array<double, 2>& moved);

/// The matrix of something that is moved, or turned about an axis through its origin [degrees].
Mat4d moved_by(const Mat4d& m, const Vec3d& offset);
Mat4d turned_by(const Mat4d& m, const Vec3d& axis, double degrees);

/// Its unit axes; those of the world where it has none.
std::array<Vec3d, 3> axes_of(const Mat4d& m);

Vec3d origin_of(const Mat4d& m);

}  // namespace velatura::view
