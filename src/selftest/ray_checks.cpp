// SPDX-License-Identifier: Apache-2.0
#include "selftest/ray_checks.h"

#include "accel/bvh.h"
#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "scene/scene.h"
#include "selftest/random.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <vector>

namespace velatura::selftest {

namespace {

struct Soup {
    std::vector<Vec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;

    accel::SoupScene scene() const {
        accel::SoupScene scene;
        scene.shapes.push_back({positions, triangles});
        return scene;
    }
};

/// Closed mesh with bumps, seen from its center all over; around `center`, where floats round its
/// corners.
Soup bumpy_ball(const Vec3d& center) {
    constexpr uint32_t rings = 24, segments = 32;
    Soup ball;
    for (uint32_t i = 0; i <= rings; ++i) {
        for (uint32_t j = 0; j < segments; ++j) {
            const double theta = pi_d * i / rings, phi = 2 * pi_d * j / segments;
            const double r = 1.0 + 0.2 * std::sin(5 * theta) * std::sin(theta) * std::cos(7 * phi);
            const Vec3d p(std::sin(theta) * std::cos(phi), std::cos(theta),
                          std::sin(theta) * std::sin(phi));
            ball.positions.push_back(to_float(center + p * r));
        }
    }
    // One point at each pole
    const auto vertex = [&](uint32_t i, uint32_t j) {
        return i == 0 ? 0 : i == rings ? rings * segments : i * segments + j % segments;
    };
    for (uint32_t i = 0; i < rings; ++i) {
        for (uint32_t j = 0; j < segments; ++j) {
            if (i > 0) ball.triangles.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
            if (i + 1 < rings)
                ball.triangles.push_back(
                    {vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)});
        }
    }
    return ball;
}

/// Whether the ray comes from behind the triangle, whose corners run clockwise as it sees them.
bool meets_back(const Soup& soup, uint32_t triangle, const geometry::Ray& ray) {
    const auto& [a, b, c] = soup.triangles[triangle];
    const Vec3d p(soup.positions[a]), q(soup.positions[b]), r(soup.positions[c]);
    return (q - p).cross(r - p).dot(Vec3d(ray.d)) > 0.0;
}

}  // namespace

Finding leaks(uint64_t amount) {
    const uint64_t rays = 100000 * amount;
    uint64_t leaked = 0;
    for (const Vec3d& center : {Vec3d(0.0), Vec3d(148376, 1234, -223423)}) {
        const Soup ball = bumpy_ball(center);
        const auto tree = accel::build_bvh(ball.scene());
        Random random(1);
        for (uint64_t i = 0; i < rays; ++i) {
            const auto& corners = ball.triangles[random.below(uint32_t(ball.triangles.size()))];
            const Vec3 a = ball.positions[corners[0]], b = ball.positions[corners[1]];
            const Vec3 aim = i % 2 == 0 ? a : a + (b - a) * random.unit();
            const Vec3 eye = to_float(center) + random.in_cube(0.1f);
            const geometry::Ray ray{eye, aim - eye};
            leaked += !tree->intersect(ray).is_valid() || !tree->is_occluded(ray);
        }
    }
    return {
        fmt::format(
            "of {} rays aimed at edges and corners from within a closed mesh, those that escape",
            2 * rays),
        double(leaked), 0};
}

Finding tree_against_loop(uint64_t amount) {
    // Some of them flat along an axis, some of the rays in their planes
    Random random(2);
    Soup soup;
    for (uint32_t i = 0; i < 200; ++i) {
        const Vec3 middle = random.in_cube(1.0f);
        for (int k = 0; k < 3; ++k) {
            Vec3 p = middle + random.in_cube(0.4f);
            if (i % 2 == 0) p[int(i / 2 % 3)] = std::round(middle[int(i / 2 % 3)] * 8.0f) / 8.0f;
            soup.positions.push_back(p);
        }
        soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const auto tree = accel::build_bvh(soup.scene());
    // Each triangle by itself, in a tree that has nothing to leave out
    std::vector<Soup> alone(soup.triangles.size());
    std::vector<std::unique_ptr<accel::Accelerator>> single;
    for (size_t i = 0; i < alone.size(); ++i) {
        alone[i] = {soup.positions, {soup.triangles[i]}};
        single.push_back(accel::build_bvh(alone[i].scene()));
    }
    const uint64_t rays = 5000 * amount;
    uint64_t different = 0;
    for (uint64_t i = 0; i < rays; ++i) {
        geometry::Ray ray{random.in_cube(1.5f), random.direction()};
        if (i % 3 == 0) ray.o[int(i / 3 % 3)] = std::round(ray.o[int(i / 3 % 3)] * 8.0f) / 8.0f;
        if (i % 4 == 0) ray.d[int(i / 4 % 3)] = i % 8 == 0 ? 0.0f : -0.0f;
        geometry::Hit nearest;
        for (uint32_t t = 0; t < single.size(); ++t) {
            const geometry::Hit hit = single[t]->intersect(ray);
            if (!hit.is_valid() || (nearest.is_valid() && hit.t > nearest.t)) continue;
            // Of those equally far away a front comes before a back, and then the first
            if (nearest.is_valid() && hit.t == nearest.t &&
                meets_back(soup, t, ray) >= meets_back(soup, nearest.triangle, ray))
                continue;
            nearest = hit;
            nearest.triangle = t;
        }
        const geometry::Hit found = tree->intersect(ray);
        const bool is_same = found.is_valid() == nearest.is_valid() &&
                             (!found.is_valid() || (found.triangle == nearest.triangle &&
                                                    std::bit_cast<uint32_t>(found.t) ==
                                                        std::bit_cast<uint32_t>(nearest.t)));
        different += !is_same || tree->is_occluded(ray) != nearest.is_valid();
    }
    return {
        fmt::format(
            "of {} rays among 200 triangles, those with another hit or another bit of its distance",
            rays),
        double(different), 0};
}

Finding self_hits(uint64_t amount) {
    const uint64_t triangles = 1000 * amount;
    Random random(3);
    uint64_t again = 0, rays = 0;
    for (uint64_t i = 0; i < triangles; ++i) {
        const float size = std::exp2(random.between(-13.0f, 20.0f));
        const Vec3 middle = random.in_cube(1000.0f * size);
        scene::Mesh mesh;
        for (int k = 0; k < 3; ++k) mesh.points.push_back(middle + random.in_cube(size));
        mesh.face_vertex_counts = {3};
        mesh.face_vertex_indices = {0, 1, 2};
        scene::Scene scene;
        scene.shapes.emplace_back();
        scene.shapes[0].geometry = mesh;
        const geometry::GeometrySet geometry(scene);
        if (geometry.shapes()[0].triangle_count() == 0) continue;
        const auto tree = accel::build_bvh(scene, geometry);
        geometry::Hit hit;
        hit.t = 1.0f;
        hit.b1 = random.unit();
        hit.b2 = random.unit() * (1.0f - hit.b1);
        hit.instance = scene::none;
        hit.shape = hit.triangle = 0;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(scene, geometry, geometry::Ray(), hit);
        for (int k = 0; k < 20; ++k) {
            Vec3 d = random.direction();
            // Many along the surface
            if (k % 2 == 1) d = d - point.ng * (point.ng.dot(d) * 0.9999f);
            ++rays;
            again += tree->intersect(geometry::spawn_ray(point, d)).is_valid();
        }
    }
    return {fmt::format("of {} rays that leave triangles of all sizes far from the origin, those "
                        "that hit them again",
                        rays),
            double(again), 0};
}

}  // namespace velatura::selftest
