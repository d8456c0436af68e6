// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

/// Wavelengths of light of one channel that is refracted by dispersive solids (docs/adr/0057).
namespace velatura::shading {

namespace dispersion_lines {

/// Fraunhofer lines [micrometers] that Abbe numbers are defined by.
inline constexpr float red_c = 0.6563f, yellow_d = 0.5876f, blue_f = 0.4861f;

}  // namespace dispersion_lines

/// Where the wavelengths of a channel begin, are densest and end [micrometers]: in between the
/// density is linear. Densest at the dominant wavelength of the primary; each begins or ends where
/// its neighbor is densest, so that white light becomes a spectrum without gaps.
struct WavelengthBand {
    float begin, peak, end;
};

using WavelengthBands = std::array<WavelengthBand, 3>;  ///< of red, green, blue

/// Of the primaries of a working space, a name of image::standard_space(); those of linear Rec.709
/// for one that has no bands.
WavelengthBands wavelength_bands(std::string_view working_space);

/// A wavelength [micrometers] of a band; u in [0, 1).
inline float sample_wavelength(const WavelengthBand& b, float u) {
    const float width = b.end - b.begin, rise = b.peak - b.begin;
    return u * width < rise ? b.begin + std::sqrt(u * width * rise)
                            : b.end - std::sqrt((1.0f - u) * width * (b.end - b.peak));
}

/// How far along a wavelength is from the line d (0) in terms of Cauchy's n = A + B/λ²: one between
/// the lines C and F.
inline float spread_of(float wavelength) {
    using namespace dispersion_lines;
    const auto square = [](float x) { return 1.0f / (x * x); };
    return (square(wavelength) - square(yellow_d)) / (square(blue_f) - square(red_c));
}

/// Index of refraction at a spread. index: at 587.6 nm; dispersion: 1 / Abbe number.
inline float dispersed_index(float index, float dispersion, float spread) {
    return std::max(index + (index - 1.0f) * dispersion * spread, 1e-3f);
}

}  // namespace velatura::shading
