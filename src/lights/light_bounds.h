// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/affine_motion.h"

#include <span>

namespace velatura::lights {

/// Where a light shines: within `spread` of any normal, the normals within `normals` of `axis`.
/// Angles in radians. Ref: Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with
/// Adaptive Tree Splitting", 4.1.
struct EmissionCone {
    Vec3d axis = Vec3d(0.0, 0.0, -1.0);  ///< unit
    double normals = pi_d;               ///< [0, π]
    double spread = pi_d / 2.0;          ///< (0, π]
    double intensity = 0;  ///< largest radiant intensity (luminance), about; > 0 when it shines
    bool is_two_sided = false;  ///< the same around the opposite axis
};

/// Box, directions and strength of a set of finite lights.
struct LightBounds {
    Box3d box;
    EmissionCone cone;

    /// Smallest bounds known to hold both.
    static LightBounds merged(const LightBounds& a, const LightBounds& b);
};

/// Directions that a normal takes while it moves: what lies between the given ones, which are of
/// any length; zero ones say nothing.
EmissionCone cone_around(std::span<const Vec3d> normals, bool is_two_sided);

/// Bounds of what is carried along: of all that is between the keys of the motion.
LightBounds carried(const LightBounds& bounds, const scene::AffineMotion& motion);

/// Box of what is carried along, at all times.
Box3d carried(const Box3d& box, const scene::AffineMotion& motion);

/// Smallest cone of normals around two of them, spreads and intensities joined.
EmissionCone merged(const EmissionCone& a, const EmissionCone& b);

}  // namespace velatura::lights
