// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::translate::color {

/// Linear Rec.709 color of a black body, of luminance 1, as UsdLuxBlackbodyTemperatureAsRgb gives
/// it: a Catmull-Rom spline through 19 knots, negative components cut to 0, kelvin clamped to
/// [1000, 10000]. 6500 K is (1.043, 0.984, 1.035), not white: D65 is no black body.
Vec3d blackbody_rgb(double kelvin);

}  // namespace velatura::translate::color
