// SPDX-License-Identifier: Apache-2.0
#include "translate/blackbody.h"

#include <algorithm>
#include <cmath>

namespace velatura::translate {

namespace {

/// Gaussian with a width for each side, in nanometres.
double lobe(double x, double peak, double inverse_left, double inverse_right) {
    const double t = (x - peak) * (x < peak ? inverse_left : inverse_right);
    return std::exp(-0.5 * t * t);
}

/// CIE 1931 2° observer, Wyman et al. 2013, equation 4.
Vec3d observer(double nm) {
    return {1.056 * lobe(nm, 599.8, 0.0264, 0.0323) + 0.362 * lobe(nm, 442.0, 0.0624, 0.0374) -
                0.065 * lobe(nm, 501.1, 0.0490, 0.0382),
            0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322),
            1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725)};
}

/// Planck's law up to a factor; relative to 560 nm, so that nothing under- or overflows.
double planck(double nm, double kelvin) {
    constexpr double c2_nm_k = 1.438776877e7;
    const double reference = std::expm1(c2_nm_k / (560.0 * kelvin));
    return std::pow(560.0 / nm, 5.0) * reference / std::expm1(c2_nm_k / (nm * kelvin));
}

}  // namespace

Vec3d blackbody_rgb(double kelvin) {
    kelvin = std::clamp(kelvin, 1000.0, 10000.0);
    Vec3d xyz(0.0);
    for (int nm = 360; nm <= 830; ++nm) xyz += observer(nm) * planck(nm, kelvin);
    // CIE XYZ to linear Rec.709, white D65 (ITU-R BT.709 primaries)
    Vec3d rgb(3.2404541621 * xyz.x - 1.5371385128 * xyz.y - 0.4985314096 * xyz.z,
              -0.9692660305 * xyz.x + 1.8760108454 * xyz.y + 0.0415560175 * xyz.z,
              0.0556434310 * xyz.x - 0.2040259135 * xyz.y + 1.0572251882 * xyz.z);
    for (int i = 0; i < 3; ++i) rgb[i] = std::max(rgb[i], 0.0);
    return rgb / (0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z);
}

}  // namespace velatura::translate
