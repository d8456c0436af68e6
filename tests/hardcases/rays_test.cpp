// SPDX-License-Identifier: Apache-2.0
// Hard cases of rays, H01 to H12.
#include "accel/bvh.h"
#include "base/tasks.h"
#include "brute_force.h"
#include "compare.h"
#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "hard_case.h"
#include "leaks.h"
#include "scene/scene.h"
#include "soups.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace velatura::accel::test {
namespace {

/// Upper end of the 95 % interval of a share of which none was seen (rule of three).
std::string none_of(size_t rays) {
    return fmt::format("a share of {:.1g}", 3.0 / double(rays));
}

TEST(H01Watertight, ClosedMeshesLeakNothing) {
    // `./dev bench watertight` shoots as many as it is asked for
    const std::vector<ClosedMesh> meshes = closed_meshes();
    // Each mesh and chunk rounds down: 10^6 are left
    const uint64_t rays = hardcase::sized(1100000, 1000000000, 1000000000) / meshes.size();
    constexpr size_t chunks = 64;
    LeakCount all;
    for (const ClosedMesh& mesh : meshes) {
        const auto bvh = build_bvh(mesh.scene());
        std::array<LeakCount, chunks> counts;
        parallel_for(chunks,
                     [&](size_t i) { counts[i] = count_leaks(*bvh, mesh, rays / chunks, 2 + i); });
        LeakCount of_mesh;
        for (const LeakCount& count : counts) of_mesh += count;
        EXPECT_EQ(of_mesh.misses + of_mesh.unseen + of_mesh.passed, 0u) << mesh.name;
        all += of_mesh;
    }
    hardcase::expect_within(
        {fmt::format("leaks of {} rays aimed at edges and vertices of {} closed meshes", all.rays,
                     meshes.size()),
         double(all.misses + all.unseen + all.passed), 0, 0, "a closed mesh has no gaps",
         none_of(all.rays)});
}

/// Whether the ray leaves a body through the triangle: the sign of a determinant in long double, 0
/// included.
bool is_leaving(const Soup& soup, const geometry::Ray& ray, uint32_t triangle) {
    using Vec = Imath::Vec3<long double>;
    const auto& v = soup.triangles[triangle];
    const Vec a(soup.positions[v[0]]), b(soup.positions[v[1]]), c(soup.positions[v[2]]);
    const long double side = (b - a).cross(c - a).dot(Vec(ray.d));
    return soup.is_flipped ? side < 0 : side > 0;
}

/// Rays from outside to edges of a convex body, and beside them by as much as floats can tell.
std::vector<geometry::Ray> rays_at_outlines(const Soup& soup,
                                            float distance,
                                            size_t count,
                                            Random& random) {
    std::vector<geometry::Ray> rays;
    for (size_t i = 0; i < count; ++i) {
        const auto& v = soup.triangles[random.below(uint32_t(soup.triangles.size()))];
        const uint32_t k = random.below(3);
        const Vec3 a = soup.positions[v[k]], b = soup.positions[v[(k + 1) % 3]];
        const Vec3 o = random.direction() * distance;
        const Vec3 target =
            a + (b - a) * random.between(0, 1) + random.in_cube(distance * 0x1p-24f);
        rays.push_back({o, target - o});
    }
    return rays;
}

// Front and back of a body meet at its outline, where both are equally far away in floats: the
// inside must not be seen.
TEST(H01Outline, OfABodyIsNotMetFromWithin) {
    Random random(23);
    size_t rays_met = 0, met_from_within = 0;
    const size_t count = hardcase::sized(100000, 10000000, 100000000);
    for (const bool is_flipped : {false, true}) {
        for (const float distance : {4.0f, 1e2f, 1e4f, 1e6f}) {
            // Eight faces, whose outline is long edges, and a finer one
            for (const int rings : {2, 12}) {
                Soup soup =
                    star_mesh(rings, rings == 2 ? 4 : 24, 1, 0, Vec3d(0.01, -0.02, 0.03), 1);
                if (is_flipped)
                    for (auto& v : soup.triangles) std::swap(v[1], v[2]);
                soup.is_flipped = is_flipped;
                const std::vector<Soup> soups = {soup};
                const auto bvh = build_bvh(scene_of(soups));
                for (const geometry::Ray& ray :
                     rays_at_outlines(soup, distance, count / 16, random)) {
                    const geometry::Hit hit = bvh->intersect(ray);
                    if (!hit.is_valid()) continue;
                    ++rays_met;
                    met_from_within += is_leaving(soup, ray, hit.triangle);
                }
            }
        }
    }
    EXPECT_GT(rays_met, count / 4);
    hardcase::expect_within(
        {fmt::format(
             "of {} rays at the outlines of closed bodies, those that meet them from within first",
             rays_met),
         double(met_from_within), 0, 0, "a convex body is entered before it is left",
         none_of(rays_met)});
}

TEST(H02BruteForce, OriginsOnSlabPlanesAndRaysAlongAxesMatchIt) {
    const std::vector<Soup> soups = {flat_triangles(40, 11), box(Vec3(-1), Vec3(1)),
                                     box(Vec3(-0.5f, -0.5f, 0), Vec3(0.5f, 0.5f, 0.125f))};
    const SoupScene scene = scene_of(soups);
    const auto bvh = build_bvh(scene);
    const BruteForce oracle(scene);
    const uint64_t chunks = hardcase::sized(1, 100, 1000);
    Agreement all;
    for (uint64_t i = 0; i < chunks; ++i) {
        const Agreement agreement = compare(*bvh, oracle, mixed_rays(1000000, 12 + i));
        all.rays += agreement.rays;
        all.hits += agreement.hits;
        all.different += agreement.different;
        all.different_occlusion += agreement.different_occlusion;
    }
    EXPECT_GT(all.hits, all.rays / 2);
    hardcase::expect_within(
        {fmt::format("hits of {} rays that differ, prim or bits of t", all.rays),
         double(all.different + all.different_occlusion), 0, 0, "brute force", none_of(all.rays)});
}

scene::Mesh mesh_of(const Soup& soup) {
    scene::Mesh mesh;
    mesh.points = soup.positions;
    for (const auto& v : soup.triangles) {
        mesh.face_vertex_counts.push_back(3);
        mesh.face_vertex_indices.insert(mesh.face_vertex_indices.end(), v.begin(), v.end());
    }
    return mesh;
}

// Rays that leave a flat triangle to either side cannot meet it again, nor can rays between two
// points be stopped by the triangles on which they end.
size_t count_rehits(const scene::Scene& scene,
                    const std::vector<geometry::Ray>& rays,
                    size_t& hits) {
    const geometry::GeometrySet geometry(scene);
    const auto bvh = build_bvh(scene, geometry);
    Random random(21);
    size_t rehits = 0;
    const int spawned = int(hardcase::sized(10, 1000, 10000));
    for (const geometry::Ray& ray : rays) {
        const geometry::Hit hit = bvh->intersect(ray);
        if (!hit.is_valid()) continue;
        ++hits;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(scene, geometry, ray, hit);
        for (int i = 0; i < spawned; ++i) {
            Vec3 d = random.direction();
            // Grazing ones too
            if (i & 1) d = normalize(d - point.ng * (d.dot(point.ng) * 0.9999f));
            const geometry::Hit next = bvh->intersect(geometry::spawn_ray(point, d));
            rehits += next.is_valid() && next.instance == hit.instance && next.shape == hit.shape &&
                      next.triangle == hit.triangle;
        }
    }
    return rehits;
}

TEST(H03SelfHits, SpawnedRaysDoNotMeetTheirTriangleAgain) {
    size_t rehits = 0, left = 0;
    for (const float size : {1e-4f, 1.0f, 1e6f}) {
        for (const float offset : {0.0f, 1e3f}) {
            scene::Scene scene;
            Soup soup = random_soup(1000, 0.3f, 22);
            for (Vec3& p : soup.positions) p = (p + Vec3(offset, -offset, 0.7f * offset)) * size;
            scene.shapes.emplace_back();
            scene.shapes[0].geometry = mesh_of(soup);
            auto rays = mixed_rays(20000, 23);
            for (geometry::Ray& ray : rays) {
                ray.o = (ray.o + Vec3(offset, -offset, 0.7f * offset)) * size;
                ray.t_max = std::numeric_limits<float>::infinity();
            }
            size_t hits = 0;
            rehits += count_rehits(scene, rays, hits);
            EXPECT_GT(hits, 5000u);
            left += hits;
        }
    }
    hardcase::expect_within(
        {fmt::format("triangles met again from {} points, sizes 1e-4 to 1e6", left), double(rehits),
         0, 0, "a plane is not met again", none_of(10 * left)});
}

TEST(H03SelfHits, NorDoRaysFromUnevenlyScaledNestedInstances) {
    scene::Scene scene;
    scene.prototypes.resize(1);
    scene.prototypes[0].shapes.emplace_back();
    scene.prototypes[0].shapes[0].geometry = mesh_of(random_soup(300, 0.5f, 24));
    Random random(25);
    for (int i = 0; i < 50; ++i) {
        // Four levels, resolved in double as translate does
        Mat4d m;
        for (int level = 0; level < 4; ++level) {
            Mat4d turn, scale, move;
            turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
            scale.setScale(level == 1 ? Vec3d(1, 1e-4, i % 2 ? -1 : 1) : Vec3d(0.9));
            move.setTranslation(Vec3d(random.in_cube(0.3f)));
            m = m * scale * turn * move;
        }
        scene.instances.emplace_back();
        scene.instances.back().render_from_prototype = Mat4(m);
    }
    auto rays = mixed_rays(20000, 26);
    for (geometry::Ray& ray : rays) ray.t_max = std::numeric_limits<float>::infinity();
    size_t hits = 0;
    const size_t rehits = count_rehits(scene, rays, hits);
    hardcase::expect_within(
        {fmt::format("triangles met again from {} points under 4 nested instances of 1:1e4", hits),
         double(rehits), 0, 0, "a plane is not met again", none_of(10 * hits)});
    EXPECT_GT(hits, 5000u);
}

// Lying across each axis in turn
TEST(H07HugeThinSlab, IsHitOnTopOnly) {
    const float half = 2.95e11f, height = 1.2e5f;
    Random random(13);
    size_t wrong = 0;
    double worst_ulp = 0;
    const uint64_t count = hardcase::sized(70000, 7000000, 350000000);
    for (int axis = 0; axis < 3; ++axis) {
        // z becomes the axis after it, and so on
        const auto turned = [axis](const Vec3& p) {
            return Vec3(p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]);
        };
        std::vector<Soup> soups = {box(Vec3(-half, -half, 0), Vec3(half, half, height))};
        for (Vec3& p : soups[0].positions) p = turned(p);
        const auto bvh = build_bvh(scene_of(soups));
        for (uint64_t i = 0; i < count; ++i) {
            const Vec3 target(random.between(-half, half), random.between(-half, half), height);
            const Vec3 o(random.between(-half, half), random.between(-half, half),
                         random.between(2.0f, 1e6f) * height);
            const Vec3 d = target - o;
            const geometry::Hit hit = bvh->intersect({turned(o), turned(d)});
            // Where the ray as given meets the plane, in double
            const double t = (double(height) - double(o.z)) / double(d.z);
            const double x = double(o.x) + t * double(d.x), y = double(o.y) + t * double(d.y);
            if (std::max(std::abs(x), std::abs(y)) > double(half)) continue;
            const bool is_top = hit.is_valid() && (hit.triangle == 2 || hit.triangle == 3);
            wrong += !is_top;
            worst_ulp = hardcase::larger(worst_ulp, std::abs(double(hit.t) - t) / (0x1p-23 * t));
        }
    }
    hardcase::expect_within(
        {fmt::format("rays of {} from above that meet anything but the top", 3 * count),
         double(wrong), 0, 0, "where the ray meets the plane", none_of(3 * count)});
    hardcase::expect_within({"distance, in units of 2^-23 of it", worst_ulp, 4, 0, "double"});
}

TEST(H10Garbage, TrianglesAreAsIfAbsent) {
    const Soup good = star_mesh(40, 40, 1.0, 0.2, Vec3d(0), 14);
    Soup bad = good;
    Random random(15);
    const float garbage[] = {std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity(),
                             std::numeric_limits<float>::max(), -std::numeric_limits<float>::max()};
    // Broken faces come after the good ones, so indices stay
    for (int i = 0; i < 10000; ++i) {
        const auto first = uint32_t(bad.positions.size());
        for (int k = 0; k < 3; ++k) bad.positions.push_back(random.in_cube(1));
        bad.positions[first + random.below(3)][int(random.below(3))] = garbage[random.below(5)];
        bad.triangles.push_back({first, first + 1, first + 2});
    }
    const std::vector<Soup> good_soups = {good}, bad_soups = {bad};
    const auto a = build_bvh(scene_of(bad_soups)), b = build_bvh(scene_of(good_soups));
    const Agreement agreement = compare(*a, *b, mixed_rays(50000, 16));
    hardcase::expect_within(
        {fmt::format("hits of {} rays that 10000 broken triangles change", agreement.rays),
         double(agreement.different + agreement.different_occlusion), 0, 0,
         "the mesh without them"});
    EXPECT_GT(agreement.hits, 10000u);
    EXPECT_EQ(a->stats().bytes, b->stats().bytes);
}

TEST(H11Coincident, TrianglesBuildAndTheFirstWins) {
    Soup soup;
    const Vec3 a(-1, -1, 2), b(1, -1, 2), c(0, 1, 2);
    soup.positions = {a, b, c};
    // Exact duplicates and the same triangle with its corners turned, which cannot be merged
    const size_t count = hardcase::sized(60000, 1000000, 1000000);
    for (size_t i = 0; i < count; ++i) {
        if (i % 1000 == 1)
            soup.triangles.push_back({1, 2, 0});
        else
            soup.triangles.push_back({0, 1, 2});
    }
    const std::vector<Soup> soups = {soup};
    const auto bvh = build_bvh(scene_of(soups));
    hardcase::expect_within({fmt::format("triangles kept of {} duplicates of two, less 2", count),
                             std::abs(double(bvh->stats().triangles) - 2), 0, 0, "count"});
    EXPECT_EQ(bvh->stats().duplicates.count, count - 2);
    EXPECT_EQ(bvh->stats().duplicates.prototype, scene::none);
    EXPECT_EQ(bvh->stats().duplicates.triangle, 2u);
    const geometry::Hit hit = bvh->intersect({Vec3(0), Vec3(0, 0, 1)});
    EXPECT_EQ(hit.triangle, 0u);
    EXPECT_EQ(hit.t, 2.0f);
    EXPECT_TRUE(bvh->is_occluded({Vec3(0), Vec3(0, 0, 1)}));
}

TEST(H11Coincident, DistinctTrianglesWithOneCentroidBuild) {
    // Boxes share their center: no plane divides them
    Soup soup;
    Random random(17);
    for (int i = 0; i < 20000; ++i) {
        const float s = random.between(0.5f, 1.0f);
        soup.add(Vec3(-s, -s, 0), Vec3(s, -s, 0), Vec3(-s, s, 0));
    }
    const std::vector<Soup> soups = {soup};
    const SoupScene scene = scene_of(soups);
    const auto bvh = build_bvh(scene);
    const BruteForce oracle(scene);
    auto rays = mixed_rays(100, 18);
    hardcase::expect_within({"hits of 100 rays among 20000 triangles of one centroid that differ",
                             double(compare(*bvh, oracle, rays).different), 0, 0, "brute force"});
}

TEST(H12Coplanar, OverlapIsWonByTheSideThenByTheIndexInAnyTree) {
    // One plane, overlapping pieces; every ray meets many of them at one t
    Soup soup;
    Random random(19);
    for (int i = 0; i < 2000; ++i) {
        Vec3 p[3];
        for (Vec3& v : p) v = Vec3(random.between(-1, 1), random.between(-1, 1), 0.5f);
        soup.add(p[0], p[1], p[2]);
    }
    const std::vector<Soup> soups = {soup, soup};
    const SoupScene scene = scene_of(soups);
    const BruteForce oracle(scene);
    Random ray_random(20);
    std::vector<geometry::Ray> rays;
    for (int i = 0; i < 500; ++i) rays.push_back({ray_random.in_cube(0.4f), Vec3(0, 0, 1)});
    size_t different = 0;
    for (const BvhOptions options :
         {BvhOptions{}, BvhOptions{.bins = 3}, BvhOptions{.max_depth = 0}}) {
        const Agreement agreement = compare(*build_bvh(scene, options), oracle, rays);
        different += agreement.different;
        EXPECT_EQ(agreement.hits, rays.size());
    }
    hardcase::expect_within({"winners among coplanar triangles that differ, three trees",
                             double(different), 0, 0, "brute force by side and index"});
}

}  // namespace
}  // namespace velatura::accel::test
