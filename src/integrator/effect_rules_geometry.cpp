// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "integrator/effect_rules.h"

namespace velatura::integrator {

using scene::Effect;

namespace {

void find_instances(EffectFindings& found) {
    for (const scene::Instance& i : found.scene.instances) found.on(found.prim_of(i.provenance), "placed as an instance");
}

void find_quadrics(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry);
        using Kind = scene::Gprim::Kind;
        if (gprim && gprim->kind != Kind::Cube && gprim->kind != Kind::Plane) found.on(found.prim_of(shape.provenance), "met as what it is, without triangles");
    });
}

template <class Geometry>
void find_shapes(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        if (std::holds_alternative<Geometry>(shape.geometry)) found.on(found.prim_of(shape.provenance), "met as what they are, without triangles");
    });
}

constexpr std::array rules = {
    EffectRule{Effect::Instancing, find_instances, nullptr},
    EffectRule{Effect::Quadrics, find_quadrics, nullptr},
    EffectRule{Effect::Subdivision, nullptr, nullptr},
    EffectRule{Effect::Displacement, nullptr, nullptr},
    EffectRule{Effect::Curves, find_shapes<scene::Curves>, nullptr},
    EffectRule{Effect::Points, find_shapes<scene::Points>, nullptr},
    EffectRule{Effect::Volumes, nullptr, nullptr},
};

}  // namespace

std::span<const EffectRule> geometry_rules() { return rules; }

}  // namespace velatura::integrator
