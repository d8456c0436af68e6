// SPDX-License-Identifier: Apache-2.0
#include "leaks.h"

#include "accel/bvh.h"
#include "base/tasks.h"

#include <array>

namespace velatura::accel::test {

void LeakCount::operator+=(const LeakCount& other) {
    rays += other.rays;
    misses += other.misses;
    passed += other.passed;
    unseen += other.unseen;
}

SoupScene ClosedMesh::scene() const {
    SoupScene scene;
    if (render_from_mesh == Mat4()) {
        scene.shapes.push_back(soup.view());
    } else {
        scene.prototypes.push_back({soup.view()});
        scene.instances.push_back({0, render_from_mesh});
    }
    return scene;
}

std::vector<ClosedMesh> closed_meshes() {
    std::vector<ClosedMesh> meshes;
    const auto add = [&](const char* name, Soup soup, const Vec3& eye, bool is_star_shaped) {
        meshes.push_back({name, std::move(soup), eye, Mat4(), is_star_shaped});
    };
    const Soup sphere = star_mesh(150, 200, 1.0, 0.0, Vec3d(0), 1);
    add("sphere", sphere, Vec3(0), true);
    // Rough: neighbors differ by up to a factor of 3 in their distance
    const Soup rough = star_mesh(100, 100, 1.0, 2.0, Vec3d(0), 3);
    add("rough", rough, Vec3(0), true);
    // Meets edges at grazing angles
    add("off center", sphere, Vec3(0.3f, -0.9f, 0.1f), false);
    const Vec3d center(148376, 1234, -223423);
    add("far, radius 2", star_mesh(80, 100, 2, 0.5, center, 6), Vec3(center), false);
    add("far, radius 1000", star_mesh(80, 100, 1000, 0.5, center, 6), Vec3(center), false);
    // An aspect of 1e6, then another on other axes
    Soup slivers = star_mesh(60, 60, 1.0, 0.3, Vec3d(0), 8);
    for (Vec3& p : slivers.positions) p.z *= 1e-6f;
    add("slivers", slivers, Vec3(0), false);
    for (Vec3& p : slivers.positions) p = Vec3(p.z, p.x * 1e3f, p.y);
    add("slivers, long", slivers, Vec3(0), false);
    Mat4d scale, turn, move;
    scale.setScale(Vec3d(2, 0.01, -1));
    turn.setAxisAngle(Vec3d(0.6, 0.48, 0.64), 1.0);
    move.setTranslation(Vec3d(3, -2, 1));
    add("uneven instance", rough, Vec3(3, -2, 1), false);
    meshes.back().render_from_mesh = Mat4(scale * turn * move);
    return meshes;
}

LeakCount count_leaks(const Accelerator& accelerator,
                      const ClosedMesh& mesh,
                      size_t rays,
                      uint64_t seed) {
    Random random(seed);
    LeakCount count;
    for (size_t i = 0; i < rays; ++i) {
        const auto& v = mesh.soup.triangles[random.below(uint32_t(mesh.soup.triangles.size()))];
        const uint32_t corner = random.below(3);
        const Vec3& a = mesh.soup.positions[v[corner]];
        const Vec3& b = mesh.soup.positions[v[(corner + 1) % 3]];
        const Vec3 target = (i & 1) ? a : a + (b - a) * random.unit();
        const geometry::Ray ray{mesh.eye,
                                transform_point(target, mesh.render_from_mesh) - mesh.eye};
        const geometry::Hit hit = accelerator.intersect(ray);
        ++count.rays;
        count.misses += !hit.is_valid();
        count.passed += mesh.is_star_shaped && hit.is_valid() && hit.t > 1.001f;
        count.unseen += !accelerator.is_occluded(ray);
    }
    return count;
}

LeakCount count_leaks(const ClosedMesh& mesh, size_t rays) {
    const auto bvh = build_bvh(mesh.scene());
    constexpr size_t chunks = 16;
    std::array<LeakCount, chunks> counts;
    parallel_for(chunks, [&](size_t i) { counts[i] = count_leaks(*bvh, mesh, rays / chunks, i); });
    LeakCount all;
    for (const LeakCount& count : counts) all += count;
    return all;
}

}  // namespace velatura::accel::test
