// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::translate {

/// Linear Rec.709 colour of a black body, of luminance 1, negative components cut to 0; kelvin is
/// clamped to [1000, 10000] as UsdLux does. UsdLux interpolates a table of this curve with 19
/// knots; here Planck's law is integrated against the CIE 1931 observer instead. Ref: Wyman, Sloan,
/// Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT
/// 2(2), the multi-lobe fits; UsdLuxBlackbodyTemperatureAsRgb (USD.md §5a).
Vec3d blackbody_rgb(double kelvin);

}  // namespace velatura::translate
