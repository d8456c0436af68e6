// SPDX-License-Identifier: Apache-2.0
// Inputs of fibers.
#include "scene/effect_calls.h"
#include "shading/material_evaluator.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

/// v in a range; NaN counts as its lower end.
float within(float v, float low, float high) {
    return v > low ? std::min(v, high) : low;
}

Rgb within(const Rgb& c, float low, float high) {
    return {within(c.x, low, high), within(c.y, low, high), within(c.z, low, high)};
}

/// Where the model means something: less than this reflects nothing, more is no hair.
constexpr float min_ior = 1.001f, largest_ior = 3.0f;

/// More absorbs everything at once, and is no different.
constexpr float max_absorption = 1e4f;

}  // namespace

HairParameters MaterialEvaluator::hair_parameters(const scene::Hair& hair,
                                                  const geometry::SurfacePoint& point,
                                                  float footprint) const {
    scene::count_call(scene::Effect::Hair);
    HairParameters p;
    p.roughness = within(scalar(hair.roughness, point, footprint), min_hair_roughness, 1.0f);
    p.azimuthal_roughness =
        within(scalar(hair.azimuthal_roughness, point, footprint), min_hair_roughness, 1.0f);
    switch (hair.absorber) {
        case scene::Hair::Absorber::Color:
            p.sigma_a = absorption_of_color(within(color(hair.color, point, footprint), 0.0f, 1.0f),
                                            p.azimuthal_roughness);
            break;
        case scene::Hair::Absorber::Melanin:
            p.sigma_a = absorption_of_melanin(
                hair, within(scalar(hair.eumelanin, point, footprint), 0.0f, max_absorption),
                within(scalar(hair.pheomelanin, point, footprint), 0.0f, max_absorption));
            break;
        case scene::Hair::Absorber::Coefficient:
            p.sigma_a = within(color(hair.absorption, point, footprint), 0.0f, max_absorption);
            break;
    }
    p.ior = within(hair.ior, min_ior, largest_ior);
    // A fifth of a right angle: no fiber has scales that stand further off
    p.cuticle_angle = within(hair.cuticle_angle_deg, -18.0f, 18.0f) * (pi / 180.0f);
    return p;
}

}  // namespace velatura::shading
