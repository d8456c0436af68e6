// SPDX-License-Identifier: Apache-2.0
// What only some surfaces have: a rough base, a coat over it, sheen over all.
#include "shading/bsdf.h"
#include "shading/bsdf_tests.h"
#include "shading/rgb_math.h"
#include "shading/rough_diffuse.h"

#include <algorithm>

namespace velatura::shading {

namespace {

/// The interface and the base are coupled for Lambert's law. A rough base sends more to where the
/// interface passes more, by this share at most (white, roughness 1): taken off, so that nothing
/// shines.
constexpr float rough_coupling_excess = 0.0066f;

}  // namespace

void Bsdf::add_extras(
    const View& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    // So far the base is Lambert's
    if (has_rough_base()) {
        value.diffuse *=
            safe_divide(rough_diffuse(p_.diffuse, p_.diffuse_roughness, v.wo, wi), p_.diffuse);
        if (has_specular_) value.diffuse /= 1.0f + rough_coupling_excess * p_.diffuse_roughness;
    }
    if (has_coat()) add_coat(v, wi, wm, cos_m, value);
    if (has_sheen()) add_sheen(v, wi, wm, std::min(wi.z, 1.0f), value);
}

/// Sheen takes its share first. What is below gets what the larger share of the two directions
/// leaves: reciprocal, and never more than there is. Ref: Kulla & Conty 2017, "Revisiting
/// Physically Based Shading at Imageworks", as MaterialX's layer operator.
void Bsdf::add_sheen(
    const View& v, const Vec3& wi, const Vec3& wm, float mu_i, BsdfValue& value) const {
    const float most = std::max(v.sheen, p_.sheen->at(mu_i, p_.sheen_roughness));
    value.diffuse *= under_sheen(most);
    value.specular *= under_sheen(most);
    value.coat *= under_sheen(most);
    if (!(wi.z > 0.0f && v.mu > 0.0f)) return;
    value.diffuse +=
        p_.sheen_color * (p_.sheen->scale(p_.sheen_roughness) *
                          sheen_f(v.mu, mu_i, std::clamp(wm.z, 0.0f, 1.0f), p_.sheen_roughness));
}

}  // namespace velatura::shading
