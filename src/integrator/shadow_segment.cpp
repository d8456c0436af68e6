// SPDX-License-Identifier: Apache-2.0
#include "integrator/shadow_segment.h"

#include "integrator/world.h"

namespace velatura::integrator {

Rgb straight_through(const shading::MaterialEvaluator& materials,
                     const geometry::SurfacePoint& point,
                     const Vec3& d,
                     float cone_width,
                     float surrounding_index) {
    if (!materials.material_is_see_through(point.material)) return Rgb(0.0f);
    if (materials.is_bare(point.material)) return Rgb(1.0f);
    const auto passed = materials.make_bsdf(point, -d, cone_width, surrounding_index)
                            .delta(shading::ScatterKind::Transmit);
    return passed && passed->eta == 1.0f ? passed->weight : Rgb(0.0f);
}

Rgb pass_dielectrics(const World& world,
                     const Vec3& d,
                     float cone_width,
                     geometry::SurfacePoint& point,
                     Interior& interior,
                     RayCounts* counts) {
    const shading::MaterialEvaluator& materials = world.materials;
    if (world.nested && materials.bounds_solid(point.material)) {
        const NestedDielectrics::Crossing crossing =
            world.nested->cross(interior, point, -d, counts);
        point = crossing.point;
        interior = crossing.beyond;
        if (!crossing.is_boundary) return Rgb(1.0f);
        return straight_through(materials, point, d, cone_width, crossing.surrounding_index);
    }
    const Rgb passed = straight_through(materials, point, d, cone_width);
    if (materials.has_absorption()) interior.cross(materials, point, -d, d);
    return passed;
}

}  // namespace velatura::integrator
