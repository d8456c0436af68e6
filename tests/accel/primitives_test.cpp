// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "brute_force.h"
#include "compare.h"
#include "geometry/geometry_set.h"
#include "geometry/quadric.h"
#include "geometry/round_curves.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::accel::test {
namespace {

// Bodies, discs and triangles, side by side and in prototypes under all sorts of placements.
struct MixedScene {
    Soup direct = random_soup(60, 0.2f, 31), star = star_mesh(6, 9, 0.6, 0.5, Vec3d(0.5, 0, 0), 32);
    SoupScene scene;

    MixedScene() {
        scene.shapes = {direct.view()};
        for (const TriangleSoupView& body : quadrics(24, 0.3, 33)) scene.shapes.push_back(body);
        scene.shapes.push_back(discs(40, 0.3, 34));
        scene.prototypes = {quadrics(6, 0.8, 35), {star.view(), discs(10, 0.8, 36)}, {star.view()}};
        scene.prototypes[1].push_back(quadrics(1, 0.8, 37)[0]);
        Random random(38);
        for (uint32_t i = 0; i < 40; ++i) {
            Mat4d scale, turn, move;
            scale.setScale(i % 4 == 1   ? Vec3d(-0.2, 0.1, 0.3)
                           : i % 4 == 2 ? Vec3d(1e-3, 0.3, 0.3)
                                        : Vec3d(0.2));
            turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
            move.setTranslation(Vec3d(random.in_cube(1)));
            scene.instances.push_back({i % 3, Mat4(scale * turn * move)});
        }
        Mat4 flat;
        flat[0][0] = 0;
        scene.instances.push_back({0, flat});
    }
};

// Curves, ribbons and balls in the same way, beside bodies.
struct StrandScene {
    Soup direct = random_soup(60, 0.2f, 61);
    SoupScene scene;

    StrandScene() {
        scene.shapes = strands(24, 0.05, 62);
        scene.shapes.push_back(direct.view());
        scene.shapes.push_back(quadrics(1, 0.3, 63)[0]);
        scene.prototypes = {strands(5, 0.2, 64), {direct.view()}};
        scene.prototypes[1].push_back(strands(3, 0.02, 65)[2]);
        Random random(66);
        for (uint32_t i = 0; i < 24; ++i) {
            Mat4d scale, turn, move;
            scale.setScale(i % 3 == 1 ? Vec3d(-0.2, 0.1, 0.3) : Vec3d(0.3));
            turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
            move.setTranslation(Vec3d(random.in_cube(1)));
            scene.instances.push_back({i % 2, Mat4(scale * turn * move)});
        }
    }
};

// From far away, where the rounding of rays is coarse, across what is far and tiny.
std::vector<geometry::Ray> far_rays(size_t count, uint64_t seed) {
    Random random(seed);
    std::vector<geometry::Ray> rays;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 o = random.direction() * std::ldexp(1.0f, int(random.below(24)));
        rays.push_back({o, random.in_cube(1) - o});
    }
    return rays;
}

void expect_brute_force(const SoupScene& scene,
                        const std::vector<geometry::Ray>& rays,
                        size_t min_hits) {
    const std::vector<geometry::Hit> expected = hits_of(BruteForce(scene), rays);
    for (const Kernels& kernels : all_kernels()) {
        BvhOptions options;
        options.kernels = &kernels;
        const Agreement agreement = compare(*build_bvh(scene, options), expected, rays);
        EXPECT_EQ(agreement.different, 0u) << kernels.name << ", " << agreement.hits << " hits";
        EXPECT_EQ(agreement.different_occlusion, 0u) << kernels.name;
        EXPECT_GE(agreement.hits, min_hits);
    }
}

}  // namespace

TEST(Primitives, AreFoundWhereBruteForceFindsThem) {
    const MixedScene mixed;
    expect_brute_force(mixed.scene, mixed_rays(8000, 39), 3000);
    expect_brute_force(mixed.scene, far_rays(8000, 40), 2000);
    SoupScene bodies;
    bodies.shapes = quadrics(500, 0.1, 41);
    expect_brute_force(bodies, mixed_rays(4000, 42), 1500);
}

TEST(Primitives, OfStrandsAreFoundWhereBruteForceFindsThem) {
    const StrandScene strands;
    expect_brute_force(strands.scene, mixed_rays(1500, 67), 250);
    expect_brute_force(strands.scene, far_rays(1000, 68), 120);
}

TEST(Primitives, OfStrandsAreTheSameUnderInstances) {
    // Under powers of two the same bits; in batches as ray by ray
    SoupScene direct, placed;
    direct.shapes = strands(10, 0.1, 69);
    placed.prototypes = {direct.shapes};
    Mat4 scale;
    scale.setScale(Vec3(4.0f));
    placed.instances = {{0, scale}};
    const auto one = build_bvh(direct), two = build_bvh(placed);
    size_t hits = 0;
    std::vector<geometry::Ray> rays = mixed_rays(4000, 70), scaled = rays;
    for (geometry::Ray& ray : scaled) {
        ray.o *= 4.0f;
        ray.d *= 4.0f;
    }
    std::vector<geometry::Hit> batch(rays.size());
    one->intersect_batch(rays, batch);
    for (size_t i = 0; i < rays.size(); ++i) {
        const geometry::Hit a = one->intersect(rays[i]), b = two->intersect(scaled[i]);
        ASSERT_EQ(a.is_valid(), b.is_valid());
        ASSERT_EQ(a.t, b.t);
        ASSERT_EQ(a.b1, b.b1);
        ASSERT_EQ(a.triangle, b.triangle);
        ASSERT_EQ(a.t, batch[i].t);
        ASSERT_EQ(a.triangle, batch[i].triangle);
        hits += a.is_valid();
    }
    EXPECT_GT(hits, 800u);
}

TEST(Primitives, AreCountedOncePerPrototypeAndBoundTheScene) {
    const MixedScene mixed;
    const auto bvh = build_bvh(mixed.scene);
    // Every fifth disc is not there
    EXPECT_EQ(bvh->stats().primitives, 24u + 32u + 6u + 8u + 1u);
    EXPECT_EQ(bvh->stats().instances, 40u);
    SoupScene one;
    one.shapes = {quadrics(1, 1, 43)};
    const Box3d expected = one.shapes[0].primitives->bounds(0).box;
    const Box3 box = build_bvh(one)->bounds();
    for (int k = 0; k < 3; ++k) {
        EXPECT_LE(double(box.min[k]), expected.min[k]);
        EXPECT_GE(double(box.max[k]), expected.max[k]);
        EXPECT_NEAR(double(box.min[k]), expected.min[k], 1e-6);
    }
}

TEST(Primitives, DoNotDependOnThreads) {
    const MixedScene mixed;
    const auto rays = mixed_rays(4000, 44);
    std::vector<geometry::Hit> expected;
    for (const int threads : {1, 7}) {
        const ThreadLimit limit(threads);
        const auto bvh = build_bvh(mixed.scene);
        if (expected.empty()) expected = hits_of(*bvh, rays);
        EXPECT_EQ(compare(*bvh, expected, rays).different, 0u);
    }
}

TEST(Primitives, GiveTiesToTheFirst) {
    // The same body directly, twice, and under instances of the identity
    SoupScene scene;
    const TriangleSoupView body = quadrics(1, 0.7, 45)[0];
    scene.shapes = {body, body};
    scene.prototypes = {{body, body}};
    scene.instances = {{0, Mat4()}, {0, Mat4()}};
    const auto bvh = build_bvh(scene);
    const SoupScene direct{{body, body}, {}, {}};
    const auto alone = build_bvh(direct);
    size_t hits = 0;
    for (const geometry::Ray& ray : mixed_rays(4000, 46)) {
        const geometry::Hit hit = bvh->intersect(ray), other = alone->intersect(ray);
        ASSERT_EQ(hit.is_valid(), other.is_valid());
        if (!hit.is_valid()) continue;
        ++hits;
        EXPECT_EQ(hit.t, other.t);
        EXPECT_EQ(hit.instance, 0u);
        EXPECT_EQ(hit.shape, 0u);
        EXPECT_EQ(other.instance, scene::none);
        EXPECT_EQ(other.shape, 0u);
    }
    EXPECT_GT(hits, 500u);
}

TEST(Primitives, OutliveTheSceneTheyWereBuiltFrom) {
    std::unique_ptr<Accelerator> bvh;
    {
        SoupScene scene;
        scene.shapes = quadrics(10, 1, 47);
        bvh = build_bvh(scene);
    }
    size_t hits = 0;
    for (const geometry::Ray& ray : mixed_rays(500, 48)) hits += bvh->intersect(ray).is_valid();
    EXPECT_GT(hits, 200u);
}

TEST(Primitives, RefuseRaysThatAreNotFinite) {
    const MixedScene mixed;
    const auto bvh = build_bvh(mixed.scene);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    inf = std::numeric_limits<float>::infinity();
    for (const float value : {nan, inf, -inf}) {
        for (int component = 0; component < 6; ++component) {
            for (geometry::Ray ray : mixed_rays(100, 49)) {
                (component < 3 ? ray.o : ray.d)[component % 3] = value;
                EXPECT_FALSE(bvh->intersect(ray).is_valid());
                EXPECT_FALSE(bvh->is_occluded(ray));
            }
        }
    }
    EXPECT_FALSE(bvh->is_occluded({Vec3(0), Vec3(0)}));
    EXPECT_FALSE(bvh->is_occluded({Vec3(0), Vec3(0, 0, 1), 0.0f}));
}

TEST(Primitives, CoverTheAreaOfTheirOutline) {
    // Parallel rays through a jittered grid: a ball covers π·r², seen along z, a cone under a
    // rotation about x by 90° a triangle. The error of n² jittered cells is that of the n·perimeter
    // cells on the outline, each of standard deviation below 1/2 cells
    Random random(50);
    const auto area = [&](const Accelerator& bvh, double half, int n) {
        const double cell = 2 * half / n;
        size_t hits = 0;
        for (int y = 0; y < n; ++y) {
            for (int x = 0; x < n; ++x) {
                const Vec3 o(float((x + double(random.unit())) * cell - half),
                             float((y + double(random.unit())) * cell - half), 100);
                hits += bvh.is_occluded({o, Vec3(0, 0, -1)});
            }
        }
        return double(hits) * cell * cell;
    };
    using Kind = scene::Gprim::Kind;
    constexpr double r = 0.9, h = 1.6;
    Mat4d upright;
    upright.setAxisAngle(Vec3d(1, 0, 0), pi_d / 2);

    const struct {
        Kind kind;
        Mat4d matrix;
        double expected, perimeter;
    } cases[] = {
        {Kind::Sphere, Mat4d(), pi_d * r * r, 2 * pi_d * r},
        {Kind::Cylinder, Mat4d(), pi_d * r * r, 2 * pi_d * r},
        {Kind::Cylinder, upright, 2 * r * h, 4 * r + 2 * h},
        {Kind::Cone, Mat4d(), pi_d * r * r, 2 * pi_d * r},
        {Kind::Cone, upright, r * h, 2 * r + 2 * std::hypot(r, h)},
        {Kind::Capsule, upright, pi_d * r * r + 2 * r * h, 2 * pi_d * r + 2 * h},
    };

    constexpr double half = 2;
    constexpr int n = 2000;
    for (const auto& c : cases) {
        scene::Scene scene;
        scene::Gprim gprim;
        gprim.kind = c.kind;
        gprim.radius = r;
        gprim.height = h;
        gprim.shape_from_gprim = c.matrix;
        scene.shapes.emplace_back();
        scene.shapes[0].geometry = gprim;
        const geometry::GeometrySet geometry(scene);
        const auto bvh = build_bvh(scene, geometry);
        EXPECT_EQ(bvh->stats().primitives, 1u);
        EXPECT_EQ(bvh->stats().triangles, 0u);
        const double cell = 2 * half / n;
        const double sigma = 0.5 * cell * cell * std::sqrt(2 * c.perimeter / cell);
        const double found = area(*bvh, half, n);
        EXPECT_NEAR(found, c.expected, 4 * sigma);
        // 96 facets around would be missing 0.07 %
        RecordProperty("smallest_detectable", std::to_string(5.28 * sigma / c.expected));
        EXPECT_LT(5.28 * sigma / c.expected, 6e-4);
    }
}

TEST(Primitives, OfRoundCurvesCoverTheAreaAlongTheirLength) {
    // A plane curve that bends less than it is thick covers its length times its width, and a disc
    // for both ends (Pappus)
    const Vec3d p[4] = {{-1.2, -0.8, 0}, {0.4, -1.2, 0}, {1.6, 0.6, 0}, {-0.6, 0.9, 0}};
    constexpr double width = 0.4;
    double length = 0;
    constexpr int steps = 100000;
    for (int i = 0; i < steps; ++i) {
        const double u = (i + 0.5) / steps, v = 1 - u;
        const Vec3d along =
            ((p[1] - p[0]) * (v * v) + (p[2] - p[1]) * (2 * u * v) + (p[3] - p[2]) * (u * u)) * 3.0;
        length += along.length() / steps;
    }
    scene::Curves curves;
    for (const Vec3d& q : p) curves.points.push_back(to_float(q));
    curves.vertex_counts = {4};
    curves.widths = {float(width)};
    SoupScene scene;
    scene.shapes = {{{}, {}, geometry::RoundCurves::make(curves)}};
    const auto bvh = build_bvh(scene);
    Random random(51);
    constexpr int n = 2000;
    constexpr double half = 2, cell = 2 * half / n;
    size_t hits = 0;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const Vec3 o(float((x + double(random.unit())) * cell - half),
                         float((y + double(random.unit())) * cell - half), 100);
            hits += bvh->is_occluded({o, Vec3(0, 0, -1)});
        }
    }
    const double expected = length * width + pi_d * width * width / 4;
    const double sigma = 0.5 * cell * cell * std::sqrt(2 * (2 * length + pi_d * width) / cell);
    EXPECT_NEAR(double(hits) * cell * cell, expected, 4 * sigma);
    EXPECT_LT(5.28 * sigma / expected, 1e-3);
}

}  // namespace velatura::accel::test
