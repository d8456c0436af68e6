// SPDX-License-Identifier: Apache-2.0
// What is below surfaces.
#include "shading/material_evaluator.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

/// v in [0, 1]; NaN counts as 0.
float unit_interval(float v) {
    return v > 0.0f ? std::min(v, 1.0f) : 0.0f;
}

/// Ways between scatterings below this part of the distance to the origin of render space are lost
/// in the rounding of points; no one sees how far light spreads by them.
constexpr float min_radius = 0x1p-14f;

/// A medium that does not turn light at all, or turns all of it back, is none.
constexpr float max_anisotropy = 0.99f;

}  // namespace

Rgb single_scattering_albedo(const Rgb& color, float g) {
    Rgb albedo;
    for (int c = 0; c < 3; ++c) {
        // A = (1 − s)(1 − 0.139 s) / (1 + 1.17 s), s² = (1 − α) / (1 − α g)
        const float a = unit_interval(color[c]), b = 1.139f + 1.17f * a;
        const float s = 2.0f * (1.0f - a) / (b + std::sqrt(b * b - 0.556f * (1.0f - a)));
        albedo[c] = (1.0f - s * s) / (1.0f - g * s * s);
    }
    return albedo;
}

float MaterialEvaluator::subsurface_weight(const scene::Material& m,
                                           const geometry::SurfacePoint& point,
                                           float footprint) const {
    return unit_interval(scalar(m.subsurface, point, footprint));
}

Subsurface MaterialEvaluator::subsurface(const geometry::SurfacePoint& point,
                                         float footprint) const {
    const scene::Material& m = scene_.materials[point.material];
    Subsurface below;
    float metallic = 0.0f;
    if (!m.use_specular_workflow) metallic = unit_interval(scalar(m.metallic, point, footprint));
    below.weight = subsurface_weight(m, point, footprint) * (1.0f - metallic);
    const Rgb base =
        color(m.subsurface_color ? *m.subsurface_color : m.diffuse_color, point, footprint);
    const Rgb radius = color(m.subsurface_radius, point, footprint);
    const float g = m.subsurface_anisotropy;
    below.anisotropy = std::isnan(g) ? 0.0f : std::clamp(g, -max_anisotropy, max_anisotropy);
    const float min = min_radius * std::max(std::abs(point.p.x),
                                            std::max(std::abs(point.p.y), std::abs(point.p.z)));
    for (int c = 0; c < 3; ++c) {
        below.color[c] = unit_interval(base[c]);
        const float r = radius[c] > min ? radius[c] : min;
        below.sigma_t[c] = r > 0.0f ? 1.0f / r : 0x1p40f;
    }
    below.albedo = single_scattering_albedo(below.color, below.anisotropy);
    return below;
}

}  // namespace velatura::shading
