// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "albedo_quadrature.h"
#include "shading/bsdf.h"
#include "shading/ggx.h"

#include <cmath>
#include <vector>

namespace velatura::shading::testing {

inline Vec3 direction(double mu, double phi = 0) {
    const double r = std::sqrt(std::max(0.0, 1 - mu * mu));
    return Vec3(float(r * std::cos(phi)), float(r * std::sin(phi)), float(mu));
}

/// ∫ f·cos over the sphere in double, and what the delta lobes add. Two deterministic rules are
/// joined by the balance heuristic: one follows GGX of width alpha, the other covers the
/// hemisphere, dense towards grazing angles.
struct Energy {
    double smooth = 0;       // non-delta reflection
    double mirror = 0;       // delta reflection
    double transmitted = 0;  // delta transmission, as power: radiance × η²

    double total() const { return smooth + mirror + transmitted; }
};

inline double half_vector_pdf(const Vec3d& wo, const Vec3d& wi, double alpha) {
    Vec3d m = wo + wi;
    const double length = std::sqrt(m.dot(m));
    return length > 0 ? ggx_pdf(wo, m / length, alpha) : 0.0;
}

/// The green channel. `bsdf` must have its shading normal along `frame.z`; wo in front of it.
inline Energy energy(const Bsdf& bsdf, const Vec3& wo, double alpha, int order = 0) {
    // The rules trade places where the lobe's tail meets the hemisphere's density: narrow lobes
    // need finer ones
    if (order == 0) order = alpha < 0.05 ? 128 : 64;
    const GaussLegendre rule(order);
    const Frame frame = Frame::from_z(bsdf.ns());
    const Vec3d o = Vec3d(frame.to_local(wo));
    const double width = std::max(alpha, double(specular_switch_alpha));
    Energy e;
    const auto add = [&](const Vec3d& local, double rule_weight) {
        if (local.z <= 0) return;
        const Vec3 wi = frame.from_local(Vec3(local));
        const Vec3d rounded = Vec3d(frame.to_local(wi));
        if (rounded.z <= 0) return;
        const double density =
            half_vector_pdf(o, rounded, width) + 1 / (4 * pi_d * std::sqrt(rounded.z));
        e.smooth += rule_weight * double(bsdf.f(wo, wi).y) * double(bsdf.cosine(wi)) / density;
    };
    for (size_t i = 0; i < rule.x.size(); ++i) {
        for (int j = 0; j < order; ++j) {
            const double u = (j + 0.5) / order, weight = rule.w[i] / order;
            add(ggx_sample(o, width, Vec2d(u, rule.x[i])), weight);
            const double z = rule.x[i] * rule.x[i], r = std::sqrt(1 - z * z);
            add(Vec3d(r * std::cos(2 * pi_d * u), r * std::sin(2 * pi_d * u), z), weight);
        }
    }
    // Every delta lobe shows up once along u_lobe; its probability tells it from its neighbors
    float last = -1;
    for (int i = 0; i < 2000; ++i) {
        const auto s = bsdf.sample_f(wo, (float(i) + 0.5f) / 2000, Vec2(0.4f, 0.6f));
        if (!s || !s->is_delta || s->pdf == last) continue;
        last = s->pdf;
        const double power = double(s->f.y) * double(bsdf.cosine(s->wi));
        if (s->kind == ScatterKind::Transmit) {
            e.transmitted += power * double(s->eta) * double(s->eta);
        } else {
            e.mirror += power;
        }
    }
    return e;
}

}  // namespace velatura::shading::testing
