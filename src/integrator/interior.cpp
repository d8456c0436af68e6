// SPDX-License-Identifier: Apache-2.0
#include "integrator/interior.h"

#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

void Interior::cross(const shading::MaterialEvaluator& materials,
                     const geometry::SurfacePoint& point,
                     const Vec3& wo,
                     const Vec3& wi) {
    if (!materials.bounds_solid(point.material)) return;
    const bool from_outside = point.ng.dot(wo) > 0.0f, to_outside = point.ng.dot(wi) > 0.0f;
    if (from_outside == to_outside) return;
    if (from_outside) {
        enter(materials, point.material);
    } else {
        leave(point.material);
    }
}

bool Interior::enter(const shading::MaterialEvaluator& materials, scene::MaterialId material) {
    if (count_ == deepest) return false;
    int place = count_++;
    const int priority = materials.priority(material);
    for (; place > 0 && materials.priority(solids_[size_t(place - 1)]) > priority; --place)
        solids_[size_t(place)] = solids_[size_t(place - 1)];
    solids_[size_t(place)] = material;
    return true;
}

bool Interior::leave(scene::MaterialId material) {
    for (int i = count_ - 1; i >= 0; --i) {
        if (solids_[size_t(i)] != material) continue;
        std::copy(solids_.begin() + i + 1, solids_.begin() + count_, solids_.begin() + i);
        --count_;
        return true;
    }
    return false;
}

Rgb Interior::transmittance(const shading::MaterialEvaluator& materials, float distance) const {
    if (count_ == 0) return Rgb(1.0f);
    const Rgb& sigma_t = materials.extinction(filling());
    if (is_black(sigma_t)) return Rgb(1.0f);
    scene::count_call(materials.scatters_inside(filling()) ? scene::Effect::InteriorMedia
                                                           : scene::Effect::Absorption);
    Rgb out(1.0f);
    for (int c = 0; c < 3; ++c) {
        // Neither 0·∞ is asked for
        if (sigma_t[c] > 0.0f && distance > 0.0f) out[c] = std::exp(-sigma_t[c] * distance);
    }
    return out;
}

}  // namespace velatura::integrator
