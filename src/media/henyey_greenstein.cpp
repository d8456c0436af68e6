// SPDX-License-Identifier: Apache-2.0
#include "media/henyey_greenstein.h"

#include "sampling/warp.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

namespace {

/// The direction that a medium of mean cosine g prefers.
Vec3 preferred(float g, const Vec3& d) {
    return g < 0.0f ? -d : d;
}

}  // namespace

HenyeyGreenstein::HenyeyGreenstein(float g)
    : g_(std::clamp(g, -1.0f + 0x1p-24f, 1.0f - 0x1p-24f)) {}

float HenyeyGreenstein::pdf(const Vec3& d, const Vec3& wi) const {
    const float a = std::abs(g_), rest = 1.0f - a;
    const Vec3 apart = wi - preferred(g_, d);
    // |wi − d|² = 2 (1 − cosθ)
    const float s2 = rest * rest + a * apart.dot(apart);
    return sampling::inv_4pi * rest * (1.0f + a) / (s2 * std::sqrt(s2));
}

Vec3 HenyeyGreenstein::sample(const Vec3& d, const Vec2& u) const {
    // The usual inverse of the distribution of cosθ, 1 + g² − 2g cosθ = s² with s = (1 − g²) / (1 −
    // g + 2gu), solved for 1 − cosθ = (s − (1 − g)) (s + (1 − g)) / 2g, in which 2g cancels
    const float a = std::abs(g_), rest = 1.0f - a;
    const float t = rest / (rest + 2.0f * a * u.x);
    const float one_minus_cos =
        std::min(2.0f, (1.0f - u.x) * t * rest * (1.0f + (1.0f + a) / (rest + 2.0f * a * u.x)));
    const float sine = safe_sqrt(one_minus_cos * (2.0f - one_minus_cos));
    const float phi = 2.0f * pi * u.y;
    const Vec3 local(sine * std::cos(phi), sine * std::sin(phi), 1.0f - one_minus_cos);
    return Frame::from_z(preferred(g_, d)).from_local(local);
}

}  // namespace velatura::media
