// SPDX-License-Identifier: Apache-2.0
#include "integrator/first_hit.h"

#include "scene/effect_calls.h"

namespace velatura::integrator {

void record_first_hit(const TracerContext& context,
                      const geometry::SurfacePoint& point,
                      const shading::Bsdf& bsdf,
                      film::SampleRadiance& out) {
    out.has_hit = true;
    out.alpha = 1.0f;
    out.prim_id = point.provenance;
    out.instance_id = point.instance;
    if (context.options.mattes) {
        scene::count_call(scene::Effect::IdMattes);
        out.matte_ids = context.options.mattes->ids(point);
    }
    if (context.options.deep) {
        scene::count_call(scene::Effect::DeepSamples);
        out.cover(film::SampleRadiance::DepthKind::Surface, context.world.camera.depth(point.p));
    }
    if (!context.has_data_layers && context.data.is_empty()) return;
    out.albedo = bsdf.albedo();
    if (context.world.subsurface && context.world.materials.has_subsurface(point.material)) {
        const shading::Subsurface below = context.world.materials.subsurface(point, 0.0f);
        out.albedo += bsdf.entering() * below.color * below.weight;
    }
    out.N = bsdf.ns();
    if (!context.data.is_empty()) context.data.record_surface(point, out.N, out.albedo, out);
    if (!context.has_data_layers) return;
    const Vec3d world = Vec3d(point.p) + context.world.scene.camera.world_position;
    out.P = Vec3(float(world.x), float(world.y), float(world.z));
    out.Z = context.world.camera.depth(point.p);
    float st[4] = {0, 0, 0, 0};
    if (point.mesh->primvar(point.mesh->texture_coordinates(), point.triangle, point.b1, point.b2,
                            st))
        out.st = Vec2(st[0], st[1]);
}

void record_first_collision(const TracerContext& context,
                            const Scatterer& scatterer,
                            const Vec3& p,
                            film::SampleRadiance& out) {
    out.has_hit = true;
    out.alpha = 1.0f;
    out.albedo = scatterer.albedo;
    const Vec3d world = Vec3d(p) + context.world.scene.camera.world_position;
    out.P = to_float(world);
    out.Z = context.world.camera.depth(p);
    out.prim_id = scatterer.provenance;
    if (!context.data.is_empty()) context.data.record_collision(p, scatterer.albedo, out);
    if (context.options.deep) {
        scene::count_call(scene::Effect::DeepSamples);
        out.cover(film::SampleRadiance::DepthKind::Volume, out.Z);
    }
}

}  // namespace velatura::integrator
