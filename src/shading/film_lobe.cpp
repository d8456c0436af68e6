// SPDX-License-Identifier: Apache-2.0
// A film on the microfacets of a reflection: what its reflectance adds to that of Schlick's formula
// between the same ends.
#include "shading/ggx_lobe.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

template <size_t count>
Rgb mean_excess(const GgxLobe& ggx, const std::array<float, count>& cosines) {
    Rgb sum(0.0f);
    for (const float c : cosines)
        sum += ggx.film->at_in_mean(c) - fresnel_schlick(ggx.f0, ggx.f90, c);
    return sum / float(count);
}

/// GGX width of the facets that turn light in the plane of w.
float width_along(const GgxLobe& ggx, const Vec3& w) {
    if (ggx.is_delta) return 0.0f;
    if (!ggx.is_anisotropic()) return ggx.alpha;
    const float x = w.x * ggx.alpha, y = w.y * ggx.alpha_y, length2 = w.x * w.x + w.y * w.y;
    return length2 > 1e-12f ? std::min(std::sqrt((x * x + y * y) / length2), 1.0f)
                            : std::min(std::sqrt(ggx.alpha * ggx.alpha_y), 1.0f);
}

}  // namespace

Rgb GgxLobe::film_albedo(const GgxAlbedo& a, const Vec3& w) const {
    const float width = width_along(*this, w), mu = std::clamp(w.z, 0.0f, 1.0f);
    if (width < specular_switch_alpha) return film->at(mu) - fresnel_schlick(f0, f90, mu);
    return mean_excess(*this, film->cosines().at(mu, width)) * (1.0f - a.loss);
}

Rgb GgxLobe::film_average() const {
    const float width = is_delta           ? 0.0f
                        : is_anisotropic() ? std::min(std::sqrt(alpha * alpha_y), 1.0f)
                                           : alpha;
    return mean_excess(*this, film->cosines().average(width)) * (1.0f - average_loss);
}

Rgb GgxLobe::mean_fresnel() const {
    const Rgb schlick = f0 + (f90 - f0) * (1.0f / 21.0f);
    return film ? schlick + mean_excess(*this, film->cosines().average(0.0f)) : schlick;
}

}  // namespace velatura::shading
