// SPDX-License-Identifier: Apache-2.0
#include "media/homogeneous_medium.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

namespace {

/// Without asking for 0·∞.
float transmittance(float extinction, float way) {
    return extinction > 0.0f && way > 0.0f ? std::exp(-extinction * way) : 1.0f;
}

bool is_gray(const Rgb& c) {
    return c.x == c.y && c.y == c.z;
}

float sum(const Rgb& c) {
    return c.x + c.y + c.z;
}

/// Transmittance of every channel over that of the one that loses least of those that were drawn
/// by: it cancels, and what is left can underflow in no denominator.
Rgb relative_transmittance(const Rgb& extinction, const Rgb& shares, float way) {
    float min = std::numeric_limits<float>::infinity();
    for (int c = 0; c < 3; ++c)
        if (shares[c] > 0.0f) min = std::min(min, extinction[c]);
    Rgb relative(0.0f);
    for (int c = 0; c < 3; ++c)
        if (shares[c] > 0.0f) relative[c] = transmittance(extinction[c] - min, way);
    return relative;
}

}  // namespace

Rgb FreePath::weight_at(float t) const {
    if (!is_drawn())
        return {transmittance(extinction.x, t), transmittance(extinction.y, t),
                transmittance(extinction.z, t)};
    if (is_gray(extinction)) return Rgb(1.0f);
    const Rgb passed = relative_transmittance(extinction, shares, t);
    return passed / sum(shares * passed);
}

Rgb FreePath::weight_of_collision() const {
    if (is_gray(extinction)) return Rgb(1.0f);
    const Rgb ended = extinction * relative_transmittance(extinction, shares, end);
    return ended / sum(shares * ended);
}

HomogeneousMedium::HomogeneousMedium(const scene::MediumProperties& medium)
    : extinction_(medium.absorption + medium.scattering), phase_(medium.anisotropy) {
    for (int c = 0; c < 3; ++c) {
        const float share = extinction_[c] > 0.0f ? medium.scattering[c] / extinction_[c] : 0.0f;
        albedo_[c] = std::min(share, 1.0f);
    }
}

FreePath HomogeneousMedium::draw(const Rgb& carried, sampling::RandomStream numbers) const {
    FreePath way;
    way.extinction = extinction_;
    const Rgb weights(std::abs(carried.x), std::abs(carried.y), std::abs(carried.z));
    const float all = sum(weights);
    way.shares = all > 0.0f ? weights / all : Rgb(1.0f / 3.0f);
    const double length = -std::log1p(-numbers.next());
    const double u = numbers.next();
    const int channel = u < double(way.shares.x)                          ? 0
                        : u < double(way.shares.x) + double(way.shares.y) ? 1
                                                                          : 2;
    // A channel without a share is never the one, though rounding may get there
    const int chosen = way.shares[channel] > 0.0f ? channel : way.shares.y > 0.0f ? 1 : 0;
    if (extinction_[chosen] > 0.0f) way.end = float(length / double(extinction_[chosen]));
    return way;
}

}  // namespace velatura::media
