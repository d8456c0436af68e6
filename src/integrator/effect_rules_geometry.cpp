// SPDX-License-Identifier: Apache-2.0
#include "integrator/effect_rules.h"

#include <array>

namespace velatura::integrator {

using scene::Effect;

namespace {

void find_instances(EffectFindings& found) {
    for (const scene::Instance& i : found.scene.instances)
        found.on(found.prim_of(i.provenance), "placed as an instance");
}

void find_quadrics(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry);
        using Kind = scene::Gprim::Kind;
        if (gprim && gprim->kind != Kind::Cube && gprim->kind != Kind::Plane)
            found.on(found.prim_of(shape.provenance), "intersected analytically");
    });
}

template <class Geometry>
void find_shapes(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        if (std::holds_alternative<Geometry>(shape.geometry))
            found.on(found.prim_of(shape.provenance), "intersected analytically");
    });
}

void find_subdivision(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
        if (mesh && mesh->subdivision != scene::SubdivisionScheme::None)
            found.on(found.prim_of(shape.provenance), "its polygons approximate a limit surface");
    });
}

void leave_out_subdivision(scene::Scene& scene) {
    const auto make_polygons = [](scene::Shape& shape) {
        if (auto* mesh = std::get_if<scene::Mesh>(&shape.geometry))
            mesh->subdivision = scene::SubdivisionScheme::None;
    };
    for (scene::Shape& shape : scene.shapes) make_polygons(shape);
    for (scene::Prototype& prototype : scene.prototypes)
        for (scene::Shape& shape : prototype.shapes) make_polygons(shape);
}

void find_displacement(EffectFindings& found) {
    for (const scene::Material& m : found.scene.materials)
        if (scene::is_displacing(m)) found.on(m.name, "moves its surfaces");
}

void leave_out_displacement(scene::Scene& scene) {
    for (scene::Material& m : scene.materials) m.displacement = scene::Input(0.0f);
}

void find_volumes(EffectFindings& found) {
    for (const scene::Volume& v : found.scene.volumes) {
        const bool scatters = scene::has_extinction(v, found.scene.volume_fields),
                   glows = scene::has_emission(v, found.scene.volume_fields);
        if (scatters || glows)
            found.on(v.name, scatters ? "scatters light within" : "gives light within");
        else
            found.zero(v.name, "its grids or its optics are zero");
    }
}

void leave_out_volumes(scene::Scene& scene) {
    scene.volumes.clear();
}

constexpr std::array rules = {
    EffectRule{Effect::Instancing, find_instances, nullptr},
    EffectRule{Effect::Quadrics, find_quadrics, nullptr},
    EffectRule{Effect::Subdivision, find_subdivision, leave_out_subdivision},
    EffectRule{Effect::Displacement, find_displacement, leave_out_displacement},
    EffectRule{Effect::Curves, find_shapes<scene::Curves>, nullptr},
    EffectRule{Effect::Points, find_shapes<scene::Points>, nullptr},
    EffectRule{Effect::LevelSets, find_shapes<scene::LevelSet>, nullptr},
    EffectRule{Effect::Volumes, find_volumes, leave_out_volumes, true},
};

}  // namespace

std::span<const EffectRule> geometry_rules() {
    return rules;
}

}  // namespace velatura::integrator
