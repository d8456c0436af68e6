// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/emitter.h"
#include "scene/affine_motion.h"

#include <optional>

namespace velatura::lights {

/// A light that moves, at one time: an Emitter, carried by an affine map. Each function asks the
/// emitter where it was made, with the receiver carried back, and brings the answer along; a
/// density changes by how the map stretches directions or areas there. Radiance, by texture,
/// shaping and filters, is that of the light where it was made. Nothing where the map is flat.
std::optional<EmitterSample> sample_moved(const Emitter& emitter,
                                          const scene::AffineMotion::Pose& pose,
                                          const Vec3d& p,
                                          const Vec2& u);

std::optional<EmitterHit> intersect_moved(const Emitter& emitter,
                                          const scene::AffineMotion::Pose& pose,
                                          const Vec3d& o,
                                          const Vec3d& d);

std::optional<EmitterPoint> sample_point_moved(const Emitter& emitter,
                                               const scene::AffineMotion::Pose& pose,
                                               const Vec2& u,
                                               const std::optional<Vec3d>& facing);

/// point: of sample_point_moved() at the same pose.
Rgb radiance_moved(const Emitter& emitter,
                   const scene::AffineMotion::Pose& pose,
                   const EmitterPoint& point,
                   const Vec3d& o,
                   const Vec3d& d);

}  // namespace velatura::lights
