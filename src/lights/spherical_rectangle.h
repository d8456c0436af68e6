// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::lights {

/// The axis-aligned rectangle [x0, x1] × [y0, y1] in the plane z = −height, seen from the origin;
/// height > 0.
struct RectangleView {
    double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
    double width = 0, length = 0;  ///< x1 − x0 and y1 − y0 as given, free of cancellation
    double height = 0;
};

/// Solid angle [sr], relative error about 1e-15 at every size and distance.
/// Ref: Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle", for both triangles;
/// their triple products are width · length · height, without cancellation.
double solid_angle(const RectangleView& view);

/// Point (x, y) on the rectangle, uniform in the solid angle it fills. Relative error of the
/// density about 1e-15 / solid angle: for tiny ones sample the area instead. Ref: Ureña, Fajardo &
/// King 2013, "An Area-Preserving Parametrization for Spherical Rectangles".
Vec2d sample_solid_angle(const RectangleView& view, double solid_angle, const Vec2& u);

}  // namespace velatura::lights
