// SPDX-License-Identifier: Apache-2.0
#include "integrator/pass_through.h"

#include "integrator/shadow_segment.h"

namespace velatura::integrator {

bool pass_cutout(const TracerContext& context, Path& path, const geometry::SurfacePoint& point) {
    if (!context.world.materials.material_has_presence(point.material)) return false;
    const float presence = context.world.materials.presence(point, path.cone_width);
    if (presence >= 1.0f) return false;
    if (path.sampler.get_1d(path.bounce, sampling::Purpose::Opacity, path.pass_count) < presence)
        return false;
    continue_straight(path, point);
    return true;
}

bool pass_straight(const TracerContext& context, Path& path, const Vertex& vertex) {
    if (path.pass_count >= pass_through_limit) return false;
    const float surrounding_index = vertex.crossing ? vertex.crossing->surrounding_index : 1.0f;
    const Rgb passed = straight_through(context.world.materials, vertex.point, -vertex.wo,
                                        path.cone_width, surrounding_index);
    if (is_black(passed)) return false;
    path.beta *= passed;
    if (keeps_interior(context.world))
        cross(context.world, vertex.crossing, vertex.point, vertex.wo, -vertex.wo, path.interior);
    continue_straight(path, vertex.point);
    path.kind = scene::RayKind::Refraction;
    return true;
}

bool intersect_dielectrics(const TracerContext& context,
                           Path& path,
                           const geometry::SurfacePoint& point,
                           std::optional<NestedDielectrics::Crossing>& storage,
                           const NestedDielectrics::Crossing*& crossing) {
    const shading::MaterialEvaluator& materials = context.world.materials;
    if (!materials.bounds_solid(point.material)) return true;
    if (!context.world.nested) {
        if (!materials.is_bare(point.material)) return true;
        path.interior.cross(materials, point, -path.ray.d, path.ray.d);
        continue_straight(path, point);
        return false;
    }
    crossing = &storage.emplace(
        context.world.nested->cross(path.interior, point, -path.ray.d, path.counts));
    if (crossing->is_boundary && !materials.is_bare(crossing->point.material)) return true;
    path.interior = crossing->beyond;
    continue_straight(path, crossing->point);
    return false;
}

}  // namespace velatura::integrator
