// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace velatura::scene {

/// How strongly a luminaire shines into which direction, as it was measured: type C photometry of
/// an IES file (ANSI/IES LM-63). The directions are those of light space.
struct IesProfile {
    /// From −Z (0) to +Z (π), ascending. There is no light outside of them.
    std::vector<double> vertical;  ///< [radians], two at least
    /// Around the axis, ascending, in [0, 2π); the last meets the first. One: the same all around.
    std::vector<double> horizontal;  ///< [radians]
    /// Candela times all factors of the file; >= 0. Between the angles it is bilinear.
    std::vector<double> intensity;  ///< [horizontal][vertical]

    double at(size_t h, size_t v) const { return intensity[h * vertical.size() + v]; }
};

/// The intensity at two angles [radians]; any horizontal one will do.
double intensity(const IesProfile& profile, double vertical, double horizontal);

/// Its mean over the sphere, or over a hemisphere when the vertical angles span no more than one:
/// what `shaping:ies:normalize` divides by. Exact for the bilinear profile but that sines are not.
/// Source: OpenUSD's reference code (hdEmbree), which sums up patches.
double mean_intensity(const IesProfile& profile);

}  // namespace velatura::scene
