// SPDX-License-Identifier: Apache-2.0
#include "scene/material.h"

#include <algorithm>
#include <cmath>

namespace velatura::scene {

namespace {

/// Colors that are left after transmission_depth count as no less where light also scatters: the
/// way of light by infinite extinction has no length to draw.
constexpr float min_left = 1e-6f;

/// Extinction by which `left` of white light passes a distance of 1.
float extinction_of(float left) {
    return left < 1.0f ? -std::log(left) : 0.0f;
}

/// Also of what is no number.
float unit_interval(float v) {
    return v > 0.0f ? std::min(v, 1.0f) : 0.0f;
}

}  // namespace

MediumProperties medium_properties_inside(const Material& m) {
    if (!can_transmit(m) || m.thin_walled) return {};
    if (m.interior) return *m.interior;
    MediumProperties inside;
    if (!(m.transmission_depth > 0.0f)) return inside;
    const bool scatters = !is_black(m.transmission_scatter);
    for (int c = 0; c < 3; ++c) {
        float left = unit_interval(m.transmission_color.value[c]);
        if (scatters) left = std::max(left, min_left);
        inside.absorption[c] = extinction_of(left) / m.transmission_depth;
    }
    if (!scatters) return inside;

    // What the color says is lost to both; where more is scattered than that, all channels get as
    // much more as the one that lacks most (OpenPBR 1.1, "Translucent base")
    inside.anisotropy = m.transmission_anisotropy;
    inside.scattering = m.transmission_scatter / m.transmission_depth;
    const Rgb rest = inside.absorption - inside.scattering;
    const float min = std::min({rest.x, rest.y, rest.z, 0.0f});
    inside.absorption = rest - Rgb(min);
    return inside;
}

}  // namespace velatura::scene
