// SPDX-License-Identifier: Apache-2.0
#include "ray_sets.h"

#include <cmath>

namespace velatura::bench {

namespace {

// A number in [0, 1) of the ray's index alone.
float number(uint64_t ray, uint64_t dimension) {
    uint64_t z = (ray * 8 + dimension + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return float((z ^ (z >> 31)) >> 40) * 0x1p-24f;
}

// Geometric normal in render space.
Vec3 normal_at(const BenchScene& scene, const geometry::Hit& hit) {
    const bool is_direct = hit.instance == scene::none;
    const BenchMesh& mesh =
        is_direct ? scene.direct : scene.prototypes[scene.instances[hit.instance].prototype];
    const auto& v = mesh.triangles[hit.triangle];
    Vec3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        p[k] = mesh.positions[v[k]];
        if (!is_direct)
            p[k] = transform_point(p[k], scene.instances[hit.instance].render_from_prototype);
    }
    return normalize(cross(p[1] - p[0], p[2] - p[0]));
}

std::vector<geometry::Ray> primary_rays(const BenchScene& scene, int size) {
    const Vec3 forward = normalize(scene.target - scene.eye);
    const Vec3 right = normalize(cross(forward, Vec3(0, 1, 0)));
    const Vec3 up = cross(right, forward);
    std::vector<geometry::Ray> rays;
    for (int tile_y = 0; tile_y < size; tile_y += 16) {
        for (int tile_x = 0; tile_x < size; tile_x += 16) {
            for (int i = 0; i < 256; ++i) {
                const float x = float(tile_x + i % 16) + number(rays.size(), 0);
                const float y = float(tile_y + i / 16) + number(rays.size(), 1);
                const float s = 1.2f / float(size);
                const Vec3 d = forward + right * ((x * s) - 0.6f) + up * (0.6f - y * s);
                rays.push_back({scene.eye, normalize(d)});
            }
        }
    }
    return rays;
}

}  // namespace

std::vector<RaySet> make_ray_sets(const BenchScene& scene,
                                  const accel::Accelerator& accelerator,
                                  int size) {
    std::vector<RaySet> sets = {{"primary", false, primary_rays(scene, size)},
                                {"bounce", false, {}},
                                {"shadow", true, {}},
                                {"ao", true, {}}};
    for (size_t i = 0; i < sets[0].rays.size(); ++i) {
        const geometry::Ray& ray = sets[0].rays[i];
        const geometry::Hit hit = accelerator.intersect(ray);
        if (!hit.is_valid()) continue;
        Vec3 n = normal_at(scene, hit);
        if (n.dot(ray.d) > 0) n = -n;
        // Any small distance will do for timing
        const Vec3 p = ray.o + ray.d * hit.t + n * (1e-4f * hit.t);
        const auto cosine = [&](uint64_t dimension) {
            const float r = std::sqrt(number(i, dimension)),
                        phi = 2 * pi * number(i, dimension + 1);
            const Vec3 local(r * std::cos(phi), r * std::sin(phi), safe_sqrt(1 - r * r));
            return normalize(Frame::from_z(n).from_local(local));
        };
        sets[1].rays.push_back({p, cosine(2)});
        const Vec3 light =
            scene.light + scene.light_x * number(i, 4) + scene.light_y * number(i, 5);
        sets[2].rays.push_back({p, light - p, 0.999f});
        sets[3].rays.push_back({p, cosine(6), scene.ambient_distance});
    }
    return sets;
}

}  // namespace velatura::bench
