// SPDX-License-Identifier: Apache-2.0
#include "integrator/mirrored_lamp.h"

#include "scene/light.h"

#include <limits>
#include <optional>

namespace velatura::integrator {

namespace {

/// Whether a ray has a lamp on it, seen through whatever surfaces. A dome is on every ray.
bool has_lamp(const World& world, const geometry::Ray& ray) {
    bool is_found = false;
    world.lights.for_each_hit(ray.o, ray.d, std::numeric_limits<float>::infinity(), ray.time,
                              [&](const lights::LightHit& hit) {
                                  is_found = is_found || world.lights.light(hit.light).kind !=
                                                             scene::LightKind::Dome;
                              });
    return is_found;
}

geometry::Ray ray_from(const geometry::SurfacePoint& point, const Vec3& direction) {
    geometry::Ray ray = geometry::spawn_ray(point, direction);
    ray.time = point.time;
    return ray;
}

/// Whether a ray inside a clear solid leaves it towards a lamp.
bool leaves_to_lamp(const World& world, const Path& path, const geometry::Ray& ray) {
    ++path.counts->indirect;
    const geometry::Hit hit = world.accelerator->intersect(ray);
    if (!hit.is_valid()) return false;
    const geometry::SurfacePoint point =
        geometry::make_surface_point(world.scene, world.geometry, ray, hit);
    const shading::Bsdf bsdf = world.materials.make_bsdf(point, -ray.d, path.cone_width);
    const auto leaving = bsdf.delta(shading::ScatterKind::Transmit);
    return leaving && has_lamp(world, ray_from(point, leaving->wi));
}

}  // namespace

bool mirrors_lamp(const TracerContext& context,
                  const Path& path,
                  const geometry::SurfacePoint& point,
                  const shading::Bsdf& bsdf) {
    if (!context.has_lamps) return false;
    const float probability = bsdf.mirror_probability();
    if (!(probability > 0.0f && probability < mirrored_lamp_probability)) return false;
    const std::optional<shading::DeltaScattering> mirrored =
        bsdf.delta(shading::ScatterKind::Reflect);
    if (!mirrored) return false;
    const geometry::Ray ray = ray_from(point, mirrored->wi);
    const bool is_inside = bsdf.has_transmission() && point.ng.dot(path.ray.d) > 0;
    if (is_inside) return path.is_sharp && leaves_to_lamp(context.world, path, ray);
    return has_lamp(context.world, ray);
}

}  // namespace velatura::integrator
