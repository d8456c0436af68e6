// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::translate::lights {

/// World-space areas of light shapes under an affine matrix, the divisors of `inputs:normalize`.
/// All scale exactly with powers of two.

/// Parallelogram.
double rect_area(double width, double height, const Mat4d& m);
/// Ellipse in the image of the xy plane.
double disk_area(double radius, const Mat4d& m);
/// Whole ellipsoid, 4π·R_G of the squared products of its semi-axes.
/// Ref: Carlson 1995, "Numerical computation of real or complex elliptic integrals", Numer.
/// Algorithms 10.
double sphere_area(double radius, const Mat4d& m);
/// Side of the (maybe oblique, elliptic) cylinder along x, without caps.
double cylinder_area(double radius, double length, const Mat4d& m);
/// Divisor of a distant light of this apex angle in degrees; 1 for angle 0. Ref:
/// UsdLux clarification proposal, DistantLight.
double distant_divisor(double angle_deg);

}  // namespace velatura::translate::lights
