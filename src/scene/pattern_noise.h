// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::scene {

/// Gradient noise in [-1, 1], 0 at integer points.
/// Ref: Perlin 2002, "Improving Noise", with the hash of Jenkins 2006, "lookup3", and the scales
/// 0.6616 and 0.9820 of Open Shading Language 1.12, which MaterialX's own code generators share.
float noise(const Vec2& p);
float noise(const Vec3& p);
/// Three that have nothing to do with each other, by the bytes of the one hash.
Vec3 noise3(const Vec2& p);
Vec3 noise3(const Vec3& p);

/// One number in [0, 1) for each unit cell; three.
float cell_noise(const Vec2& p);
float cell_noise(const Vec3& p);
Vec3 cell_noise3(const Vec2& p);
Vec3 cell_noise3(const Vec3& p);

}  // namespace velatura::scene
