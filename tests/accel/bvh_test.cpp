// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh.h"

#include "accel/ray_stream.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "brute_force.h"
#include "compare.h"
#include "expect_exact.h"
#include "hard_case.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <limits>

namespace velatura::accel::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

void expect_exact(const std::vector<Soup>& soups,
                  const std::vector<geometry::Ray>& rays,
                  size_t min_hits) {
    test::expect_exact(scene_of(soups), rays, min_hits);
}

TEST(Bvh, FindsWhatBruteForceFindsInRandomTriangles) {
    const auto rays = mixed_rays(20000, 1);
    expect_exact({random_soup(700, 0.1f, 2), random_soup(300, 0.5f, 3)}, rays, 5000);
    expect_exact({random_soup(9, 0.8f, 4)}, rays, 1000);
    expect_exact({random_soup(1, 2.0f, 5)}, rays, 100);
}

TEST(Bvh, FindsWhatBruteForceFindsInShapesThatAreInsideOut) {
    std::vector<Soup> soups = {random_soup(700, 0.1f, 2), random_soup(300, 0.5f, 3)};
    soups[0].is_flipped = true;
    expect_exact(soups, mixed_rays(20000, 1), 5000);
}

TEST(Bvh, FindsWhatBruteForceFindsAmongNeedles) {
    const auto rays = mixed_rays(10000, 6);
    expect_exact({needles(300, 1e2f, 7), needles(300, 1e4f, 8), needles(300, 1e6f, 9)}, rays, 100);
}

// Every quality finds the same hits, and they build different trees.
TEST(Bvh, HitsDoNotDependOnQuality) {
    const std::vector<Soup> soups = {rods(400, 0.01f, 45), random_soup(3000, 0.05f, 46),
                                     flat_triangles(200, 47)};
    const auto rays = mixed_rays(10000, 48);
    const std::vector<geometry::Hit> expected = hits_of(BruteForce(scene_of(soups)), rays);
    std::vector<size_t> nodes;
    for (const BvhQuality quality : {BvhQuality::Fast, BvhQuality::Balanced, BvhQuality::High}) {
        const auto bvh = build_bvh(scene_of(soups), options_of(quality));
        const Agreement agreement = compare(*bvh, expected, rays);
        EXPECT_EQ(agreement.different, 0u) << name_of(quality);
        EXPECT_EQ(agreement.different_occlusion, 0u) << name_of(quality);
        EXPECT_STREQ(bvh->stats().quality, name_of(quality));
        nodes.push_back(bvh->stats().nodes);
    }
    EXPECT_NE(nodes[0], nodes[1]);
    EXPECT_NE(nodes[1], nodes[2]);
}

TEST(Bvh, QualityGrowsWithTheRaysPerTriangle) {
    EXPECT_EQ(choose_quality(0, 1000), BvhQuality::Fast);
    EXPECT_EQ(choose_quality(20000, 1000), BvhQuality::Balanced);
    EXPECT_EQ(choose_quality(1e9, 1000), BvhQuality::High);
    EXPECT_EQ(choose_quality(1e9, 0), BvhQuality::High);
}

// Rays along a triangle's plane, and towards its corners and edges.
std::vector<geometry::Ray> rays_along(const Soup& soup, size_t count, uint64_t seed) {
    Random random(seed);
    std::vector<geometry::Ray> rays;
    for (size_t i = 0; i < count; ++i) {
        const auto& v = soup.triangles[random.below(uint32_t(soup.triangles.size()))];
        const Vec3 &a = soup.positions[v[0]], &b = soup.positions[v[1]], &c = soup.positions[v[2]];
        const Vec3 inside = a + (b - a) * random.unit() * 0.5f + (c - a) * random.unit() * 0.5f;
        const Vec3 in_plane =
            a + (b - a) * random.between(-2, 2) + (c - a) * random.between(-30, 30);
        if (i % 3 == 0) rays.push_back({in_plane, inside - in_plane});
        if (i % 3 == 1) rays.push_back({random.in_cube(2), inside - random.in_cube(2)});
        if (i % 3 == 2) {
            const Vec3 o = random.in_cube(2);
            rays.push_back({o, a + (b - a) * random.unit() - o});
        }
    }
    return rays;
}

TEST(Bvh, FindsWhatBruteForceFindsAmongDividedTriangles) {
    for (const float width : {0.02f, 1e-3f, 1e-6f}) {
        const std::vector<Soup> soups = {rods(200, width, 31), random_soup(1500, 0.05f, 32)};
        const SoupScene scene = scene_of(soups);
        const size_t whole = build_bvh(scene, {.spare_references = 0})->stats().references;
        const size_t divided = build_bvh(scene)->stats().references;
        EXPECT_EQ(whole, build_bvh(scene)->stats().triangles);
        EXPECT_GT(divided, whole + 200) << "hardly any triangle was divided";
        expect_exact(soups, mixed_rays(10000, 33), 500);
        expect_exact(soups, rays_along(soups[0], 10000, 34), 3000);
    }
    // Far from the origin the margins are those of rounding
    std::vector<Soup> far = {rods(300, 0.01f, 35)};
    for (Vec3& p : far[0].positions) p += Vec3(4000, -3000, 5000);
    expect_exact(far, rays_along(far[0], 10000, 36), 1000);
}

// Shapes of fewer than eight triangles leave lanes of their leaf without one.
TEST(Bvh, LanesWithoutTrianglesAreNotMet) {
    for (size_t count = 1; count <= 8; ++count)
        expect_exact({random_soup(count, 1.5f, 40 + count)}, mixed_rays(2000, 41), 50);
}

// The filter for occlusion decides without double: at bounds, before the origin, near zero.
TEST(Bvh, OcclusionAgreesWithTheClosestHitAtEveryBound) {
    const std::vector<Soup> soups = {random_soup(500, 0.3f, 42), flat_triangles(100, 43)};
    const SoupScene scene = scene_of(soups);
    const auto bvh = build_bvh(scene);
    size_t hits = 0;
    std::vector<geometry::Ray> batch;
    std::vector<uint8_t> expected;
    const auto expect = [&](const geometry::Ray& ray, bool is_occluded) {
        EXPECT_EQ(bvh->is_occluded(ray), is_occluded);
        batch.push_back(ray);
        expected.push_back(is_occluded);
    };
    for (geometry::Ray ray : mixed_rays(20000, 44)) {
        for (const float scale : {1.0f, 0x1p-60f, 0x1p60f}) {
            geometry::Ray scaled = ray;
            scaled.d *= scale;
            scaled.t_max = inf;
            const geometry::Hit hit = bvh->intersect(scaled);
            expect(scaled, hit.is_valid());
            if (!hit.is_valid()) continue;
            ++hits;
            scaled.t_max = hit.t;
            expect(scaled, false);
            scaled.t_max = next_float_up(hit.t);
            expect(scaled, true);
        }
    }
    EXPECT_GT(hits, 20000u);
    std::vector<uint8_t> occluded(batch.size());
    bvh->is_occluded_batch(batch, occluded);
    EXPECT_EQ(occluded, expected);
}

TEST(RayStream, ChoosesAWayByTimingBothAndFindsTheSame) {
    const std::vector<Soup> soups = {random_soup(2000, 0.1f, 51)};
    const SoupScene scene = scene_of(soups);
    const auto bvh = build_bvh(scene);
    const std::vector<geometry::Ray> rays = mixed_rays(1000, 52);
    const std::vector<geometry::Hit> expected = hits_of(*bvh, rays);
    RayStream closest(*bvh), any(*bvh);
    std::vector<geometry::Hit> hits(rays.size());
    std::vector<uint8_t> occluded(rays.size());
    // Too few rays are no trial
    closest.intersect(std::span(rays).first(RayStream::smallest_trial - 1), hits);
    for (int i = 0; i < 20; ++i) {
        EXPECT_EQ(closest.has_chosen(), i >= 17 || !bvh->has_batches());
        closest.intersect(rays, hits);
        any.is_occluded(rays, occluded);
        for (size_t k = 0; k < rays.size(); ++k) {
            ASSERT_TRUE(is_same(hits[k], expected[k])) << k;
            ASSERT_EQ(occluded[k] != 0, expected[k].is_valid()) << k;
        }
    }
    EXPECT_TRUE(closest.has_chosen());
}

TEST(Bvh, FindsWhatBruteForceFindsInFlatBoxesWithRaysInTheirPlanes) {
    expect_exact({flat_triangles(800, 10)}, mixed_rays(20000, 11), 10000);
    expect_exact({box(Vec3(-1), Vec3(1)), box(Vec3(-0.5f), Vec3(0.5f, 0.5f, -0.5f))},
                 mixed_rays(20000, 12), 5000);
}

TEST(Bvh, AgreesWithMollerTrumboreInLongDouble) {
    const std::vector<Soup> soups = {random_soup(500, 0.3f, 13)};
    const SoupScene scene = scene_of(soups);
    const auto bvh = build_bvh(scene);
    size_t compared = 0;
    for (const geometry::Ray& ray : mixed_rays(5000, 14)) {
        const OracleHit oracle = moller_trumbore(scene, ray);
        const geometry::Hit hit = bvh->intersect(ray);
        // Hits on an edge may go either way
        if (oracle.hit.is_valid() && oracle.margin < 1e-9) continue;
        ASSERT_EQ(hit.is_valid(), oracle.hit.is_valid());
        if (!hit.is_valid()) continue;
        ++compared;
        ASSERT_EQ(hit.triangle, oracle.hit.triangle);
        // One rounding of a value that is exact to double precision
        EXPECT_NEAR(double(hit.t), oracle.t, oracle.t * 0x1p-24 * 1.001);
        EXPECT_NEAR(hit.b1, oracle.hit.b1, 0x1p-24f);
        EXPECT_NEAR(hit.b2, oracle.hit.b2, 0x1p-24f);
    }
    EXPECT_GT(compared, 1500u);
}

TEST(Bvh, DropsDegenerateTrianglesAndOnlyThose) {
    Soup good = random_soup(300, 0.3f, 15);
    Soup mixed;
    std::vector<uint32_t> name;  // triangle of `good` for each of `mixed`
    Random random(16);
    for (uint32_t i = 0; i < good.triangles.size(); ++i) {
        const Vec3 a = random.in_cube(1), b = random.in_cube(1);
        mixed.add(a, a, b);
        mixed.add(a, b, b);
        mixed.add(a, a, a);
        mixed.add(Vec3(0), Vec3(0.25f), Vec3(0.75f));
        mixed.add(a, Vec3(nan, 0, 0), b);
        mixed.add(a, Vec3(0, inf, 0), b);
        mixed.add(a, Vec3(0, 0, -inf), b);
        mixed.add(a, Vec3(3e38f, 0, 0), b);
        name.resize(mixed.triangles.size(), scene::none);
        mixed.add(good.positions[3 * i], good.positions[3 * i + 1], good.positions[3 * i + 2]);
        name.push_back(i);
    }
    const std::vector<Soup> good_soups = {good}, mixed_soups = {mixed};
    const auto expected = build_bvh(scene_of(good_soups));
    const auto bvh = build_bvh(scene_of(mixed_soups));
    EXPECT_EQ(bvh->stats().triangles, good.triangles.size());
    size_t hits = 0;
    for (const geometry::Ray& ray : mixed_rays(5000, 17)) {
        geometry::Hit hit = bvh->intersect(ray);
        if (hit.is_valid()) hit.triangle = name[hit.triangle];
        EXPECT_TRUE(is_same(hit, expected->intersect(ray)));
        hits += hit.is_valid();
    }
    EXPECT_GT(hits, 500u);
}

TEST(Bvh, IsNotSearchedForRaysThatAreNotFinite) {
    const Box3 bounds(Vec3(-1), Vec3(1));
    const geometry::Ray usual{Vec3(0.1f, 0.2f, 3), Vec3(0.3f, 0.1f, -1)};
    EXPECT_TRUE(is_traced(usual, bounds));
    for (const float bad : {nan, inf, -inf}) {
        for (int k = 0; k < 3; ++k) {
            geometry::Ray ray = usual;
            ray.d[k] = bad;
            EXPECT_FALSE(is_traced(ray, bounds)) << "d" << k << " " << bad;
            ray = usual;
            ray.o[k] = bad;
            EXPECT_FALSE(is_traced(ray, bounds)) << "o" << k << " " << bad;
        }
    }
}

TEST(H10Garbage, RaysThatAreNotFiniteMiss) {
    const std::vector<Soup> soups = {random_soup(500, 0.5f, 18)};
    const auto bvh = build_bvh(scene_of(soups));
    int met = 0;
    for (const float bad : {nan, -nan, inf, -inf}) {
        for (int component = 0; component < 6; ++component) {
            for (geometry::Ray ray : mixed_rays(50, 19)) {
                (component < 3 ? ray.o : ray.d)[component % 3] = bad;
                met += bvh->intersect(ray).is_valid() + bvh->is_occluded(ray);
            }
        }
    }
    hardcase::expect_within(
        {"hits of 1200 rays with a component that is no number", double(met), 0, 0, "none"});
    for (const float t_max : {nan, 0.0f, -1.0f, -inf}) {
        for (geometry::Ray ray : mixed_rays(50, 20)) {
            ray.t_max = t_max;
            EXPECT_FALSE(bvh->intersect(ray).is_valid());
            EXPECT_FALSE(bvh->is_occluded(ray));
        }
    }
    EXPECT_FALSE(bvh->intersect({Vec3(0), Vec3(0)}).is_valid());
    EXPECT_FALSE(bvh->is_occluded({Vec3(0), Vec3(-0.0f)}));
}

TEST(Bvh, IsEmptyForAnEmptyScene) {
    const auto bvh = build_bvh(SoupScene{});
    EXPECT_FALSE(bvh->intersect({Vec3(0), Vec3(1)}).is_valid());
    EXPECT_FALSE(bvh->is_occluded({Vec3(0), Vec3(1)}));
    EXPECT_TRUE(bvh->bounds().isEmpty());
    EXPECT_EQ(bvh->stats().triangles, 0u);
}

TEST(Bvh, TreatsTheEndOfTheRayAsOutside) {
    Soup wall;
    wall.add(Vec3(-1, -1, 3), Vec3(1, -1, 3), Vec3(0, 1, 3));
    const std::vector<Soup> soups = {wall};
    const auto bvh = build_bvh(scene_of(soups));
    const geometry::Ray ray{Vec3(0), Vec3(0, 0, 1), 3.0f};
    EXPECT_FALSE(bvh->intersect(ray).is_valid());
    EXPECT_FALSE(bvh->is_occluded(ray));
    const geometry::Ray longer{Vec3(0), Vec3(0, 0, 1), next_float_up(3.0f)};
    EXPECT_EQ(bvh->intersect(longer).t, 3.0f);
    EXPECT_TRUE(bvh->is_occluded(longer));
    // t = 0 does not count either
    EXPECT_FALSE(bvh->intersect({Vec3(0, 0, 3), Vec3(0, 0, 1)}).is_valid());
}

TEST(Bvh, KeepsBitsUnderScalingByPowersOfTwo) {
    const std::vector<Soup> soups = {random_soup(800, 0.2f, 21), needles(100, 1e5f, 22),
                                     flat_triangles(200, 23)};
    const auto bvh = build_bvh(scene_of(soups));
    const auto rays = mixed_rays(4000, 24);
    for (const int exponent : {-40, -20, -7, 7, 20, 40}) {
        std::vector<Soup> scaled = soups;
        const float s = std::ldexp(1.0f, exponent);
        for (Soup& soup : scaled) {
            for (Vec3& p : soup.positions) p *= s;
        }
        const auto scaled_bvh = build_bvh(scene_of(scaled));
        EXPECT_EQ(scaled_bvh->stats().nodes, bvh->stats().nodes);
        size_t different = 0;
        for (const geometry::Ray& ray : rays) {
            const geometry::Hit expected = bvh->intersect(ray);
            // Scale the direction too, or leave it and scale t
            different +=
                !is_same(scaled_bvh->intersect({ray.o * s, ray.d * s, ray.t_max}), expected);
            geometry::Hit far = scaled_bvh->intersect({ray.o * s, ray.d, ray.t_max * s});
            if (far.is_valid()) far.t /= s;
            different += !is_same(far, expected);
        }
        EXPECT_EQ(different, 0u) << "2^" << exponent;
    }
}

TEST(Bvh, FindsWhatBruteForceFindsWhereProductsOverflow) {
    const Soup soup = random_soup(300, 0.3f, 61);
    const auto rays = mixed_rays(1000, 62);
    for (const int exponent : {-100, -70, 64, 80, 98, 115}) {
        const float s = std::ldexp(1.0f, exponent);
        std::vector<Soup> scaled = {soup};
        for (Vec3& p : scaled[0].positions) p *= s;
        std::vector<geometry::Ray> scaled_rays;
        for (const geometry::Ray& ray : rays) {
            // A direction as long as the scene or as it is
            scaled_rays.push_back({ray.o * s, ray.d * s, ray.t_max});
            scaled_rays.push_back({ray.o * s, ray.d, ray.t_max * s});
        }
        const SoupScene scene = scene_of(scaled);
        const Agreement agreement = compare(*build_bvh(scene), BruteForce(scene), scaled_rays);
        EXPECT_EQ(agreement.different, 0u) << "2^" << exponent;
        EXPECT_EQ(agreement.different_occlusion, 0u) << "2^" << exponent;
        EXPECT_GT(agreement.hits, 200u) << "2^" << exponent;
    }
}

TEST(Bvh, DoesNotDependOnThreadsOrTreeShape) {
    // Large enough for parallel binning
    const std::vector<Soup> soups = {random_soup(150000, 0.02f, 25)};
    const auto rays = mixed_rays(2000, 26);
    std::unique_ptr<Accelerator> first;
    for (const int threads : {1, 2, 3}) {
        const ThreadLimit limit(threads);
        auto bvh = build_bvh(scene_of(soups));
        if (!first)
            first = std::move(bvh);
        else {
            EXPECT_EQ(bvh->stats().nodes, first->stats().nodes);
            EXPECT_EQ(bvh->stats().bytes, first->stats().bytes);
            EXPECT_EQ(compare(*bvh, *first, rays).different, 0u);
        }
    }
    for (const BvhOptions options : {BvhOptions{.bins = 4}, BvhOptions{.bins = 32},
                                     BvhOptions{.max_depth = 0}, BvhOptions{.max_depth = 5}}) {
        const auto bvh = build_bvh(scene_of(soups), options);
        EXPECT_EQ(compare(*bvh, *first, rays).different, 0u);
    }
}

}  // namespace
}  // namespace velatura::accel::test
