// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>

namespace velatura::lights {

/// Names a light of a LightSet: a light of the scene, or an emissive triangle. See LightSet.
struct LightId {
    uint32_t index = 0;
    uint32_t part = 0;  ///< which triangle of an instance; 0 otherwise

    LightId() = default;

    // Lights of the scene are known by their index alone
    LightId(uint32_t i, uint32_t p = 0) : index(i), part(p) {}  // NOLINT: implicit on purpose

    friend bool operator==(const LightId&, const LightId&) = default;
};

/// Width of a ray's footprint where it starts and how much it grows per unit of distance: what
/// textures on emissive surfaces are filtered with.
struct RayCone {
    float width = 0, spread = 0;
};

/// Non-physical factors of a light's effect on diffuse and on other lobes.
struct LobeMultipliers {
    float diffuse = 1, specular = 1;
};

/// A direction toward a light.
struct LightSample {
    Vec3 wi;             ///< unit, from p toward the light
    float distance = 0;  ///< to the point on the light; +infinity for distant and dome lights
    Rgb Le = Rgb(0.0f);  ///< radiance that arrives unoccluded; irradiance across wi when is_delta
    float pdf = 0;       ///< [1/sr], without the probability of picking this light; 1 when is_delta
    bool is_delta = false;     ///< no other sampler can find it: MIS weight 1
    bool is_surface = false;   ///< an emissive triangle, which also blocks light
    Vec3 target = Vec3(0.0f);  ///< is_surface: point beside it from which p is seen without meeting
                               ///< the surface itself
};

/// A light that a ray crosses.
struct LightHit {
    uint32_t light = 0;
    float t = 0;         ///< distance along the ray; +infinity for distant and dome lights
    Rgb Le = Rgb(0.0f);  ///< radiance toward the ray's origin
    float pdf = 0;       ///< what sample() has for this direction from the ray's origin, [1/sr]
};

}  // namespace velatura::lights
