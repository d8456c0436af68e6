// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/world.h"

namespace velatura::app {

/// How far triangles are off the subdivision surfaces that they stand for, as an outline would show
/// it: 99 % of the edges in the image are off by less, in pixels. An edge is taken for the chord
/// of the arc that its ends' normals span, which is right to the fourth order of its length. 0
/// where nothing is subdivided.
double outline_error_px(const integrator::World& world);

/// Height of an arc over its chord. normals: at the ends, of any length.
double arc_height(const Vec3d& chord, const Vec3d& normal_a, const Vec3d& normal_b);

}  // namespace velatura::app
