// SPDX-License-Identifier: Apache-2.0
// What only some surfaces have: a rough base, a coat over it, sheen over all.
#include "shading/bsdf.h"
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
    const LayerView& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    // So far the base is Lambert's
    if (features_.has_rough_base()) {
        value.diffuse *=
            safe_divide(rough_diffuse(p_.diffuse, p_.diffuse_roughness, v.wo, wi), p_.diffuse);
        if (has_specular_) value.diffuse /= 1.0f + rough_coupling_excess * p_.diffuse_roughness;
    }
    if (features_.has_coat()) coat_.add(v, wi, wm, cos_m, value);
    if (features_.has_sheen()) sheen_.add(v, wi, wm, std::min(wi.z, 1.0f), value);
}

}  // namespace velatura::shading
