// SPDX-License-Identifier: Apache-2.0
// Thin gaps and thin walls far from the origin (H04), and points that were authored there (H05).
#include "accel/bvh.h"
#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "hard_case.h"
#include "scene/scene.h"
#include "soups.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::accel::test {
namespace {

/// A square across `axis` at `place`, of two triangles; other coordinates around `middle`.
scene::Shape square(int axis, float place, float middle, float half) {
    scene::Mesh mesh;
    for (int i = 0; i < 4; ++i) {
        Vec3 p;
        p[axis] = place;
        p[(axis + 1) % 3] = middle + ((i ^ i >> 1) & 1 ? half : -half);
        p[(axis + 2) % 3] = middle + (i & 2 ? half : -half);
        mesh.points.push_back(p);
    }
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    return shape;
}

float ulp_of(float x) {
    return std::nextafter(x, std::numeric_limits<float>::infinity()) - x;
}

/// Rays between two parallel squares `gap_ulp` apart.
struct GapCount {
    size_t rays = 0;
    size_t skipped = 0;    ///< did not meet the other square
    size_t misplaced = 0;  ///< met it elsewhere than where they should
};

GapCount shoot_across(int axis, float place, int gap_ulp, uint64_t count) {
    const float gap = float(gap_ulp) * ulp_of(place), half = 64 * gap;
    scene::Scene scene;
    scene.shapes = {square(axis, place, place, half), square(axis, place + gap, place, half)};
    const geometry::GeometrySet geometry(scene);
    const auto bvh = build_bvh(scene, geometry);
    Random random(uint64_t(gap_ulp) * 7 + uint64_t(axis));
    GapCount result;
    for (uint64_t i = 0; i < count; ++i) {
        const uint32_t from = i % 2;
        geometry::Hit hit;
        hit.b1 = random.between(0.3f, 0.4f);
        hit.b2 = random.between(0.3f, 0.4f);
        hit.t = 1;
        hit.instance = scene::none;
        hit.shape = from;
        hit.triangle = uint32_t(i / 2 % 2);
        const geometry::SurfacePoint point =
            geometry::make_surface_point(scene, geometry, geometry::Ray(), hit);
        // Across the gap, steeply enough to stay within the squares
        Vec3 d(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
        d[axis] = (from == 0 ? 1.0f : -1.0f) * random.between(0.25f, 1.0f);
        const geometry::Ray ray = geometry::spawn_ray(point, d);
        const geometry::Hit next = bvh->intersect(ray);
        ++result.rays;
        if (!next.is_valid() || next.shape == from || !bvh->is_occluded(ray)) {
            ++result.skipped;
            continue;
        }
        const double t =
            (double(from == 0 ? place + gap : place) - double(ray.o[axis])) / double(ray.d[axis]);
        result.misplaced += std::abs(double(next.t) - t) > 4 * 0x1p-23 * t;
    }
    return result;
}

// What starts on one side of a gap meets the other side; what starts on a face of a wall is stopped
// by its other face
TEST(H04ThinGaps, AreSeenAndThinWallsDoNotLeak) {
    const uint64_t count = hardcase::sized(4000, 1000000, 10000000);
    for (const int gap_ulp : {8, 64, 1024}) {
        GapCount all;
        for (const float place : {1.0f, 1e4f, 1e5f, 1e6f, 1e7f}) {
            for (int axis = 0; axis < 3; ++axis) {
                const GapCount one = shoot_across(axis, place, gap_ulp, count);
                all.rays += one.rays;
                all.skipped += one.skipped;
                all.misplaced += one.misplaced;
            }
        }
        hardcase::expect_within(
            {fmt::format("rays of {} that skip a gap of {} ulp, at 1 to 1e7", all.rays, gap_ulp),
             double(all.skipped), 0, 0, "the other side is there",
             fmt::format("a share of {:.1g}", 3.0 / double(all.rays))});
        EXPECT_EQ(all.misplaced, 0u) << gap_ulp;
    }
}

// Planes across no axis: how large a gap is never skipped, in ulp of the coordinates
TEST(H04ThinGaps, OfAnyDirectionAreSeen) {
    const uint64_t count = hardcase::sized(100000, 10000000, 100000000);
    Random random(41);
    double worst = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const float place = std::exp2(random.between(0, 24));
        const Vec3 middle(random.between(-place, place), random.between(-place, place), place);
        scene::Scene scene;
        scene::Mesh mesh;
        for (int k = 0; k < 3; ++k) mesh.points.push_back(middle + random.in_cube(0.01f * place));
        mesh.face_vertex_counts = {3};
        mesh.face_vertex_indices = {0, 1, 2};
        scene.shapes.emplace_back();
        scene.shapes[0].geometry = mesh;
        const geometry::GeometrySet geometry(scene);
        geometry::Hit hit;
        hit.b1 = random.between(0, 1);
        hit.b2 = random.between(0, 1) * (1 - hit.b1);
        hit.t = 1;
        hit.instance = scene::none;
        hit.shape = hit.triangle = 0;
        if (geometry.shapes()[0].triangle_count() == 0) continue;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(scene, geometry, geometry::Ray(), hit);
        // Height of the start over the plane through the corners, in double
        const Vec3d a(mesh.points[0]),
            n = (Vec3d(mesh.points[1]) - a).cross(Vec3d(mesh.points[2]) - a);
        const Vec3 up = n.dot(Vec3d(point.ng)) > 0 ? point.ng : -point.ng;
        const double height =
            (Vec3d(geometry::offset_ray_origin(point, up)) - a).dot(n.normalized());
        EXPECT_GT(height, 0.0);
        worst = hardcase::larger(worst, height / double(ulp_of(place)));
    }
    hardcase::expect_within(
        {"highest start over a plane of any direction, in ulp of the largest coordinate", worst, 8,
         0, "height over the plane in double"});
}

// Points that are authored far away are what floats make of them: hits are no farther off than
// those
TEST(H05FarFromTheOrigin, PointsBakedThereAreHitWhereTheyAre) {
    constexpr float place = 1e6f;
    const float ulp = ulp_of(place);
    Random random(42);
    double worst = 0;
    size_t hits = 0;
    const uint64_t rounds = hardcase::sized(2000, 1000000, 10000000);
    for (uint64_t i = 0; i < rounds; ++i) {
        Soup soup;
        const Vec3 middle(place, -0.7f * place, 0.9f * place);
        Vec3 corner[3];
        for (Vec3& c : corner) c = middle + random.in_cube(10);
        soup.add(corner[0], corner[1], corner[2]);
        scene::Scene scene;
        scene.shapes.emplace_back();
        scene::Mesh mesh;
        mesh.points = soup.positions;
        mesh.face_vertex_counts = {3};
        mesh.face_vertex_indices = {0, 1, 2};
        scene.shapes[0].geometry = mesh;
        const geometry::GeometrySet geometry(scene);
        const auto bvh = build_bvh(scene, geometry);
        const Vec3d a(corner[0]), b(corner[1]), c(corner[2]), n = (b - a).cross(c - a);
        if (n.length() < 1) continue;
        for (int k = 0; k < 20; ++k) {
            const Vec3 aim = (corner[0] + corner[1] + corner[2]) / 3.0f + random.in_cube(0.5f);
            geometry::Ray ray{middle + random.in_cube(100), Vec3(0)};
            ray.d = aim - ray.o;
            const geometry::Hit hit = bvh->intersect(ray);
            if (!hit.is_valid()) continue;
            // Grazing rays move along the plane by more than they are off it
            const Vec3d d(ray.d), o(ray.o);
            if (std::abs(d.dot(n)) < 0.3 * d.length() * n.length()) continue;
            ++hits;
            const Vec3d truth = o + d * ((a - o).dot(n) / d.dot(n));
            const geometry::SurfacePoint point =
                geometry::make_surface_point(scene, geometry, ray, hit);
            for (int x = 0; x < 3; ++x)
                worst =
                    hardcase::larger(worst, std::abs(double(point.p[x]) - truth[x]) / double(ulp));
        }
    }
    EXPECT_GT(hits, rounds);
    hardcase::expect_within({fmt::format("{} hits at 1e6, coordinates in ulp of 1e6", hits), worst,
                             1, 0, "ray and plane in double"});
}

}  // namespace
}  // namespace velatura::accel::test
