// SPDX-License-Identifier: Apache-2.0
#include "geometry/motion.h"

#include "accel/bvh.h"
#include "accel/traverse.h"
#include "base/tasks.h"
#include "brute_force.h"
#include "compare.h"
#include "expect_exact.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::accel::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

// Every third ray at a time that is a key of many motions, the others anywhere.
std::vector<geometry::Ray> timed(std::vector<geometry::Ray> rays, uint64_t seed) {
    Random random(seed);
    for (size_t i = 0; i < rays.size(); ++i)
        rays[i].time = i % 3 == 0 ? float(random.below(12)) / 12.0f : random.unit();
    return rays;
}

// Adds keys by moving each point of the one before: move(point, vertex).
template <class Move>
Soup with_keys(Soup soup, uint32_t segments, const Move& move) {
    std::vector<Vec3> key = soup.positions;
    for (uint32_t s = 0; s < segments; ++s) {
        for (size_t i = 0; i < key.size(); ++i) key[i] = move(key[i], i);
        soup.later_positions.push_back(key);
    }
    return soup;
}

// Every point its own way.
Soup jittered(const Soup& soup, uint32_t segments, float distance, uint64_t seed) {
    Random random(seed);
    return with_keys(soup, segments,
                     [&](const Vec3& p, size_t) { return p + random.in_cube(distance); });
}

// Turned about the axis z by so many degrees from key to key: at 180 all points pass through it.
Soup spinning(const Soup& soup, uint32_t segments, double degrees) {
    const double angle = degrees * pi_d / 180, c = std::cos(angle), s = std::sin(angle);
    return with_keys(soup, segments, [&](const Vec3& p, size_t) {
        const double x = double(p.x), y = double(p.y);
        return Vec3(float(c * x - s * y), float(s * x + c * y), p.z);
    });
}

TEST(Motion, FindsWhatBruteForceFindsAtTheTimeOfEachRay) {
    const auto rays = timed(mixed_rays(20000, 1), 2);
    for (const uint32_t segments : {1u, 2u, 3u, 5u}) {
        const std::vector<Soup> soups = {
            jittered(random_soup(500, 0.1f, 3), segments, 0.02f, 4),
            jittered(random_soup(200, 0.4f, 5), segments, 0.5f, 6),
            jittered(random_soup(100, 0.2f, 7), 7 - segments, 0.2f, 8),  // another number of keys
            random_soup(100, 0.2f, 9)};
        expect_exact(scene_of(soups), rays, 5000);
    }
}

TEST(Motion, FindsWhatBruteForceFindsAmongSpinsAndLeaps) {
    const auto rays = timed(mixed_rays(20000, 11), 12);
    Random random(13);
    for (const double degrees : {10.0, 90.0, 180.0}) {
        const std::vector<Soup> soups = {spinning(random_soup(300, 0.3f, 14), 3, degrees),
                                         spinning(needles(100, 1e4f, 15), 2, degrees),
                                         spinning(flat_triangles(200, 16), 1, degrees)};
        expect_exact(scene_of(soups), rays, 1000);
    }
    // One key far away, single points far away, everything on one place
    const std::vector<Soup> soups = {
        with_keys(random_soup(300, 0.3f, 17), 2,
                  [&](const Vec3& p, size_t) { return p * 4.0f + Vec3(0.1f); }),
        with_keys(random_soup(300, 0.3f, 18), 1,
                  [&](const Vec3& p, size_t) { return p + Vec3(3e4f, 0, -2e6f); }),
        with_keys(random_soup(300, 0.3f, 19), 2,
                  [&](const Vec3& p, size_t i) { return i % 50 ? p : p * 1e3f; }),
        with_keys(random_soup(300, 0.3f, 20), 1, [&](const Vec3&, size_t) { return Vec3(0.25f); })};
    expect_exact(scene_of(soups), rays, 5000);
    for (const Soup& soup : soups) expect_exact(scene_of({soup}), rays, 100);
}

TEST(Motion, FindsWhatBruteForceFindsAtEverySizeAndDistance) {
    const auto rays = timed(mixed_rays(3000, 21), 22);
    const Soup soup = jittered(random_soup(300, 0.3f, 23), 2, 0.2f, 24);
    for (const int exponent : {-100, -60, 40, 80, 115}) {
        const float s = std::ldexp(1.0f, exponent);
        std::vector<Soup> soups = {soup};
        for (Vec3& p : soups[0].positions) p *= s;
        for (auto& key : soups[0].later_positions)
            for (Vec3& p : key) p *= s;
        std::vector<geometry::Ray> scaled = rays;
        for (geometry::Ray& ray : scaled) {
            ray.o *= s;
            ray.d *= s;
        }
        expect_exact(scene_of(soups), scaled, 500);
    }
    std::vector<Soup> far = {soup};
    const Vec3 shift(4000, -3000, 5000);
    for (Vec3& p : far[0].positions) p += shift;
    for (auto& key : far[0].later_positions)
        for (Vec3& p : key) p += shift;
    std::vector<geometry::Ray> shifted = rays;
    for (geometry::Ray& ray : shifted) ray.o += shift;
    expect_exact(scene_of(far), shifted, 500);
}

TEST(Motion, OfATriangleEndsWhereItsCornersAreNotNumbers) {
    const Soup good = jittered(random_soup(200, 0.4f, 31), 3, 0.3f, 32);
    Soup mixed = good;
    Random random(33);
    // Whole and in single keys: not numbers, too far, no area
    for (uint32_t i = 0; i < 200; ++i) {
        Vec3 p[4][3];
        const auto first = uint32_t(mixed.positions.size());
        for (int key = 0; key < 4; ++key) {
            for (Vec3& v : p[key]) v = random.in_cube(1);
        }
        const uint32_t key = random.below(4), kind = random.below(7);
        if (kind == 0) p[key][0].x = nan;
        if (kind == 1) p[key][1].y = -inf;
        if (kind == 2) p[key][2].z = 3e38f;
        if (kind == 3) p[key][2] = p[key][1];
        if (kind == 4) p[key][0] = p[key][1] = p[key][2];
        for (int k = 0; k < 4; ++k) {
            if (kind == 5) p[k][0] = p[k][1];
            if (kind == 6) p[k][2] = p[k][0] + (p[k][1] - p[k][0]) * 0.5f;
            auto& to = k == 0 ? mixed.positions : mixed.later_positions[size_t(k) - 1];
            to.insert(to.end(), p[k], p[k] + 3);
        }
        mixed.triangles.push_back({first, first + 1, first + 2});
    }
    expect_exact(scene_of({mixed}), timed(mixed_rays(20000, 34), 35), 5000);
}

TEST(Motion, OfPrototypesIsCarriedByTheirInstances) {
    const std::vector<Soup> prototypes = {jittered(random_soup(100, 0.5f, 41), 2, 0.4f, 42),
                                          random_soup(50, 0.5f, 43),
                                          spinning(box(Vec3(-1), Vec3(1)), 3, 60)};
    const std::vector<Soup> direct = {jittered(random_soup(50, 0.3f, 44), 1, 0.2f, 45)};
    SoupScene scene = scene_of(direct);
    scene.prototypes = {{prototypes[0].view(), prototypes[1].view()},
                        {prototypes[1].view()},
                        {prototypes[2].view()}};
    Random random(46);
    for (uint32_t i = 0; i < 40; ++i) {
        Mat4d scale, turn, move;
        scale.setScale(i % 2 ? Vec3d(0.2, 0.2, 0.2) : Vec3d(-0.3, 0.1, 0.2));
        turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
        move.setTranslation(Vec3d(random.in_cube(1)));
        scene.instances.push_back({i % 3, Mat4(scale * turn * move)});
    }
    expect_exact(scene, timed(mixed_rays(8000, 47), 48), 2000);
}

Mat4 random_placement(Random& random, float size) {
    Mat4d scale, turn, move;
    scale.setScale(Vec3d(0.3) + Vec3d(random.in_cube(0.2f)));
    if (random.below(3) == 0) scale[0][0] = -scale[0][0];
    turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
    move.setTranslation(Vec3d(random.in_cube(size)));
    return Mat4(scale * turn * move);
}

// Slow ones, fast ones, some that turn inside out or flatten on their way, among others that stay.
TEST(Motion, OfInstancesIsFoundAsBruteForceFindsIt) {
    const std::vector<Soup> prototypes = {random_soup(60, 0.5f, 141), box(Vec3(-1), Vec3(1)),
                                          jittered(random_soup(60, 0.5f, 142), 2, 0.3f, 143)};
    SoupScene scene;
    for (const Soup& soup : prototypes) scene.prototypes.push_back({soup.view()});
    scene.prototypes.push_back({discs(20, 0.6, 144), quadrics(1, 0.5, 145)[0]});
    Random random(146);
    std::vector<std::vector<Mat4>> later;
    for (uint32_t i = 0; i < 80; ++i) {
        const Mat4 first = random_placement(random, 1);
        std::vector<Mat4>& keys = later.emplace_back();
        for (uint32_t k = 0; k < i % 4; ++k) {
            Mat4d drift;
            drift.setTranslation(Vec3d(random.in_cube(i % 8 < 4 ? 0.1f : 1.0f)));
            const Mat4 last = keys.empty() ? first : keys.back();
            if (i % 3 == 0) keys.push_back(random_placement(random, 1));
            if (i % 3 == 1) keys.push_back(Mat4(Mat4d(last) * drift));
            if (i % 3 == 2) {
                // Half a turn: through a line
                Mat4d turn;
                turn.setAxisAngle(Vec3d(0, 0, 1), pi_d);
                keys.push_back(Mat4(turn * Mat4d(last)));
            }
        }
        scene.instances.push_back({i % 4, first});
    }
    // A key flat, one that is not finite
    later[7].back()[0][0] = later[7].back()[1][0] = later[7].back()[2][0] = 0;
    later[11].back()[3][1] = nan;
    for (size_t i = 0; i < later.size(); ++i) scene.instances[i].later = later[i];
    const Soup direct = random_soup(50, 0.3f, 147);
    scene.shapes = {direct.view()};
    expect_exact(scene, timed(mixed_rays(20000, 148), 149), 5000);
    EXPECT_EQ(build_bvh(scene)->stats().instances, scene.instances.size() - 1);
}

// An instance at a key of its motion is the instance that stays there.
TEST(Motion, OfInstancesPassesThroughTheirKeys) {
    const std::vector<Soup> prototypes = {random_soup(200, 0.5f, 151)};
    Random random(152);
    std::vector<std::vector<Mat4>> keys(30);
    for (auto& of_instance : keys)
        for (int k = 0; k < 4; ++k) of_instance.push_back(random_placement(random, 1));
    SoupScene moving;
    moving.prototypes = {{prototypes[0].view()}};
    for (const auto& k : keys) moving.instances.push_back({0, k[0], std::span(k).subspan(1)});
    const auto bvh = build_bvh(moving);
    for (size_t key = 0; key < 3; ++key) {
        SoupScene still;
        still.prototypes = moving.prototypes;
        for (const auto& k : keys) still.instances.push_back({0, k[key]});
        const auto expected = build_bvh(still);
        size_t hits = 0, different = 0;
        for (geometry::Ray ray : mixed_rays(5000, 153)) {
            const geometry::Hit of_key = expected->intersect(ray);
            ray.time = float(key) / 3.0f;
            if (geometry::motion_time(ray.time, 3).f != 0.0f) continue;
            hits += of_key.is_valid();
            different += !is_same(bvh->intersect(ray), of_key);
        }
        EXPECT_EQ(different, 0u) << key;
        EXPECT_GT(hits, key == 0 ? 1000u : 0u);
    }
}

// What a moving mesh is at a key is the mesh of that key. Corners that stay, far outside of all
// that moves, give both the same bounds: edge-on hits depend on these.
TEST(Motion, AtItsKeysIsTheMeshOfTheKey) {
    for (const uint32_t segments : {1u, 2u, 3u, 8u}) {
        Soup soup = random_soup(400, 0.3f, 51);
        for (const Vec3& v : {Vec3(-20), Vec3(20)})
            soup.add(v, v + Vec3(0.5f, 0, 0), v + Vec3(0, 0.5f, 0));
        Random random(52);
        const size_t still = soup.positions.size() - 6;
        soup = with_keys(soup, segments, [&](const Vec3& p, size_t i) {
            return i < still ? p + random.in_cube(0.5f) : p;
        });
        const auto moving = build_bvh(scene_of({soup}));
        for (uint32_t key = 0; key < segments; ++key) {
            const std::vector<Soup> at_key = {
                {key == 0 ? soup.positions : soup.later_positions[key - 1], soup.triangles}};
            const auto expected = build_bvh(scene_of(at_key));
            const float time = float(key) / float(segments);
            ASSERT_EQ(geometry::motion_time(time, segments).f, 0.0f);
            size_t hits = 0, different = 0;
            for (geometry::Ray ray : mixed_rays(5000, 53)) {
                const geometry::Hit of_key = expected->intersect(ray);
                ray.time = time;
                hits += of_key.is_valid();
                different += !is_same(moving->intersect(ray), of_key);
                different += moving->is_occluded(ray) != of_key.is_valid();
            }
            EXPECT_EQ(different, 0u) << "key " << key << " of " << segments;
            EXPECT_GT(hits, 1000u);
        }
    }
}

// The segments of a motion meet at keys, all of them; times outside count as the nearest inside.
TEST(Motion, RunsThroughItsKeysFromTheOpeningOfTheShutterToItsEnd) {
    for (uint32_t segments = 1; segments < 100; ++segments) {
        for (uint32_t key = 0; key < segments; ++key) {
            // As near as a float comes to the key
            const auto at = geometry::motion_time(float(key) / float(segments), segments);
            const float x = float(at.segment) + at.f;
            EXPECT_NEAR(x, float(key), 1e-4f);
            EXPECT_LT(at.f, 1.0f);
        }
        const auto last = geometry::motion_time(next_float_down(1.0f), segments);
        EXPECT_EQ(last.segment, segments - 1);
        EXPECT_LE(last.f, 1.0f);
        for (const float time : {1.0f, 2.0f, inf}) {
            EXPECT_EQ(geometry::motion_time(time, segments).segment, segments - 1);
            EXPECT_EQ(geometry::motion_time(time, segments).f, 1.0f);
        }
        for (const float time : {0.0f, -1.0f, -inf, nan}) {
            EXPECT_EQ(geometry::motion_time(time, segments).segment, 0u);
            EXPECT_EQ(geometry::motion_time(time, segments).f, 0.0f);
        }
    }
}

// Rays at what shared edges and vertices are at their time, from within a closed mesh that bulges,
// turns and wanders around them.
TEST(Motion, LeavesNoGapBetweenTrianglesAtAnyTime) {
    Random random(61);
    Soup soup = star_mesh(60, 80, 1.0, 1.0, Vec3d(0), 62);
    std::vector<float> swell(soup.positions.size());
    for (float& s : swell) s = random.between(0.5f, 2);
    // Either all points by one map, or each towards or away from the eye: the eye sees all of it
    // all the time
    const auto turn = [](const Vec3& p) {
        const float c = std::cos(0.5f), s = std::sin(0.5f);
        return Vec3(c * p.x - s * p.y, s * p.x + c * p.y, 0.7f * p.z + 0.2f * p.x);
    };
    const size_t points = soup.positions.size();
    size_t moves = 0;
    soup = with_keys(soup, 3, [&](const Vec3& p, size_t i) {
        return moves++ / points == 1 ? p * swell[i] : turn(p);
    });
    for (const Kernels& kernels : all_kernels()) {
        BvhOptions options;
        options.kernels = &kernels;
        const auto bvh = build_bvh(scene_of({soup}), options);
        size_t misses = 0, unseen = 0, behind = 0;
        for (int i = 0; i < 60000; ++i) {
            const float time = random.unit();
            const auto at = geometry::motion_time(time, 3);
            const auto& from =
                at.segment == 0 ? soup.positions : soup.later_positions[at.segment - 1];
            const auto& v = soup.triangles[random.below(uint32_t(soup.triangles.size()))];
            const auto corner = [&](size_t k) {
                return geometry::moved(from[v[k]], soup.later_positions[at.segment][v[k]], at.f);
            };
            const Vec3 a = corner(0), b = corner(1);
            const Vec3 target = i % 2 ? a : a + (b - a) * random.unit();
            const geometry::Ray ray{Vec3(0), target, inf, time};
            const geometry::Hit hit = bvh->intersect(ray);
            misses += !hit.is_valid();
            unseen += !bvh->is_occluded(ray);
            behind += hit.is_valid() && hit.t > 1.001f;
        }
        EXPECT_EQ(misses, 0u) << kernels.name;
        EXPECT_EQ(unseen, 0u) << kernels.name;
        EXPECT_EQ(behind, 0u) << kernels.name;
    }
}

TEST(Motion, DoesNotDependOnThreadsOrTreeShape) {
    const std::vector<Soup> soups = {jittered(random_soup(30000, 0.03f, 71), 2, 0.05f, 72),
                                     random_soup(2000, 0.05f, 73)};
    const auto rays = timed(mixed_rays(3000, 74), 75);
    std::unique_ptr<Accelerator> first;
    for (const int threads : {1, 2, 3}) {
        const ThreadLimit limit(threads);
        auto bvh = build_bvh(scene_of(soups));
        if (first) {
            EXPECT_EQ(bvh->stats().nodes, first->stats().nodes);
            EXPECT_EQ(bvh->stats().bytes, first->stats().bytes);
            EXPECT_EQ(compare(*bvh, *first, rays).different, 0u);
        } else {
            first = std::move(bvh);
        }
    }
    for (const BvhOptions options : {BvhOptions{.bins = 4}, BvhOptions{.leaf_size = 2},
                                     BvhOptions{.max_depth = 0}, BvhOptions{.max_depth = 5}}) {
        const auto bvh = build_bvh(scene_of(soups), options);
        EXPECT_EQ(compare(*bvh, *first, rays).different, 0u);
    }
}

// What stays where it is while other parts of its mesh move is met as if nothing moved.
TEST(Motion, LeavesPointsThatStayWhereTheyAre) {
    Soup still = random_soup(300, 0.3f, 81);
    Soup moving = still;
    moving.later_positions = {still.positions, still.positions};
    const auto expected = build_bvh(scene_of({still})), bvh = build_bvh(scene_of({moving}));
    EXPECT_EQ(bvh->stats().triangles, expected->stats().triangles);
    EXPECT_EQ(compare(*bvh, *expected, timed(mixed_rays(10000, 82), 83)).different, 0u);
}

// Exact duplicates in numbers that no plane can divide.
TEST(Motion, KeepsTheFirstOfDuplicates) {
    Soup soup;
    for (int i = 0; i < 100; ++i) soup.add(Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(0, 1, 0));
    soup = with_keys(soup, 1,
                     [](const Vec3& p, size_t i) { return p + Vec3(0, 0, i < 150 ? 1.0f : 2.0f); });
    expect_exact(scene_of({soup}), timed(mixed_rays(5000, 91), 92), 500);
}

// Also where they are nowhere at some keys: what is not a number has no order.
TEST(Motion, KeepsTheFirstOfDuplicatesThatAreNotNumbersAtAKey) {
    Soup soup;
    for (int i = 0; i < 100; ++i) soup.add(Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(0, 1, 0));
    soup = with_keys(soup, 2, [](const Vec3& p, size_t) { return p + Vec3(0, 0, 1); });
    // Of two kinds, each nowhere at the first key
    for (size_t i = 0; i < soup.positions.size(); ++i) soup.positions[i].y = i % 2 ? nan : inf;
    for (size_t i = 150; i < 300; ++i) soup.later_positions[1][i].z += 1;
    expect_exact(scene_of({soup}), timed(mixed_rays(5000, 93), 94), 100);
    const AcceleratorStats stats = build_bvh(scene_of({soup}))->stats();
    EXPECT_EQ(stats.triangles, 2u);
    EXPECT_EQ(stats.duplicates.count, 98u);
    EXPECT_EQ(stats.duplicates.triangle, 1u);
}

// Entries of a matrix round to floats by what they are at both keys: where an instance that is
// placed from far away shrinks to nothing, that is more than its size.
TEST(Motion, OfInstancesThatVanishFarFromTheirOriginIsFoundToTheEnd) {
    Soup far = box(Vec3(-1), Vec3(1));
    for (Vec3& p : far.positions) p += Vec3(10000, -7000, 3000);
    SoupScene scene;
    scene.prototypes = {{far.view()}};
    Mat4 first, last;
    first[3][0] = -10000.3f;
    first[3][1] = 7000.2f;
    first[3][2] = -3000.1f;
    for (int i = 0; i < 3; ++i) last[i][i] = 0;
    const std::vector<Mat4> later = {last};
    scene.instances.push_back({0, first, later});
    Random random(162);
    std::vector<geometry::Ray> rays;
    for (int i = 0; i < 100000; ++i) {
        // To where the instance is about to vanish
        const float rest = random.between(0.001f, 0.02f);
        const Vec3 target = (Vec3(-0.3f, 0.2f, -0.1f) + random.in_cube(1.4f)) * rest;
        const Vec3 o = random.direction() * 2.0f;
        rays.push_back({o, target - o, inf, 1 - rest});
    }
    expect_exact(scene, rays, 10000);
}

}  // namespace
}  // namespace velatura::accel::test
