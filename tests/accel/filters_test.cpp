// SPDX-License-Identifier: Apache-2.0
// Rays that meet some classes of the geometry only.
#include "accel/bvh.h"
#include "accel/traverse.h"
#include "brute_force.h"
#include "compare.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <limits>

namespace velatura::accel::test {
namespace {

using scene::LinkClass;
using scene::LinkSet;

LinkSet random_set(size_t classes, float share, Random& random) {
    LinkSet set(classes);
    for (LinkClass c = 0; c < classes; ++c)
        if (random.unit() < share) set.add(c);
    return set;
}

std::vector<LinkClass> random_classes(size_t count, uint32_t classes, Random& random) {
    std::vector<LinkClass> result;
    for (size_t i = 0; i < count; ++i) result.push_back(random.below(classes));
    return result;
}

// What the scene would be if nothing else were in it.
SoupScene only(const SoupScene& scene, const LinkSet& met) {
    SoupScene left = scene;
    left.classes = {};
    for (size_t i = 0; i < left.shapes.size(); ++i)
        if (!met.holds(scene.classes.of_shape[i])) left.shapes[i] = {};
    return left;
}

Mat4 placed(Random& random) {
    Mat4 m;
    m.setAxisAngle(random.direction(), random.between(0, 6));
    m.translate(random.in_cube(0.6f));
    return m;
}

// Triangles and quadrics of many classes, placed directly and in instances.
struct ManyClasses {
    explicit ManyClasses(uint32_t class_count, uint64_t seed, uint32_t segments = 0)
        : classes(class_count) {
        Random random(seed);
        for (uint64_t i = 0; i < 12; ++i)
            soups.push_back(soup(40, 0.4f, seed + i, segments, random));
        for (uint64_t i = 0; i < 9; ++i)
            inner.push_back(soup(30, 0.3f, seed + 100 + i, segments, random));
        for (const Soup& s : soups) scene.shapes.push_back(s.view());
        for (const TriangleSoupView& q : quadrics(7, 0.2, seed + 50)) scene.shapes.push_back(q);
        for (size_t p = 0; p < 3; ++p) {
            scene.prototypes.emplace_back();
            for (size_t i = 0; i < 3; ++i)
                scene.prototypes.back().push_back(inner[3 * p + i].view());
            for (const TriangleSoupView& q : quadrics(2, 0.2, seed + 60 + p))
                scene.prototypes.back().push_back(q);
        }
        scene.classes.of_shape = random_classes(scene.shapes.size(), class_count, random);
        for (int row = 0; row < 6; ++row)
            scene.classes.rows.push_back(random_classes(5, class_count, random));
        // One row of a single class
        scene.classes.rows.emplace_back(5, class_count - 1);
        for (uint32_t i = 0; i < 24; ++i) {
            scene.instances.push_back({i % 3, placed(random)});
            const uint32_t row = random.below(8);
            scene.classes.row_of_instance.push_back(row == 7 ? scene::none : row);
        }
        if (segments == 0) return;
        for (uint32_t i = 0; i < 12; ++i) later.push_back({placed(random)});
        for (uint32_t i = 0; i < 12; ++i) scene.instances[2 * i].later = later[i];
    }

    static Soup soup(size_t count, float size, uint64_t seed, uint32_t segments, Random& random) {
        Soup s = random_soup(count, size, seed);
        for (uint32_t k = 0; k < segments; ++k) {
            s.later_positions.push_back(s.positions);
            for (Vec3& p : s.later_positions.back()) p += random.in_cube(0.3f);
        }
        return s;
    }

    uint32_t classes;
    std::vector<Soup> soups, inner;
    std::vector<std::vector<Mat4>> later;
    SoupScene scene;
};

// With every instruction set.
void expect_exact(const SoupScene& scene,
                  const std::vector<geometry::Ray>& rays,
                  const LinkSet& met,
                  size_t min_hits) {
    const BruteForce brute(scene);
    std::vector<geometry::Hit> expected;
    size_t hits = 0;
    for (const geometry::Ray& ray : rays) {
        expected.push_back(brute.intersect_some(ray, met));
        hits += expected.back().is_valid();
    }
    EXPECT_GE(hits, min_hits);
    for (const Kernels& kernels : all_kernels()) {
        const auto bvh = build_bvh(scene, {.kernels = &kernels});
        size_t different = 0, different_occlusion = 0;
        for (size_t i = 0; i < rays.size(); ++i) {
            different += !is_same(bvh->intersect_some(rays[i], met), expected[i]);
            different_occlusion += bvh->is_occluded_by_some(rays[i], met) != expected[i].is_valid();
        }
        EXPECT_EQ(different, 0u) << kernels.name;
        EXPECT_EQ(different_occlusion, 0u) << kernels.name;
    }
}

TEST(RayFilters, MeetWhatBruteForceMeetsAmongTheSameClasses) {
    for (const uint32_t classes : {2u, 5u, 33u, 200u}) {
        const ManyClasses many(classes, 10 * classes);
        Random random(classes);
        for (const float share : {0.1f, 0.5f, 0.9f}) {
            const LinkSet met = random_set(classes, share, random);
            expect_exact(many.scene, mixed_rays(3000, classes), met, met.is_empty() ? 0 : 10);
        }
    }
}

TEST(RayFilters, MeetWhatMovesAtTheTimeOfEachRay) {
    for (const uint32_t segments : {1u, 3u}) {
        const ManyClasses many(9, 70 + segments, segments);
        Random random(segments);
        std::vector<geometry::Ray> rays = mixed_rays(3000, segments);
        for (geometry::Ray& ray : rays) ray.time = random.unit();
        expect_exact(many.scene, rays, random_set(9, 0.5f, random), 100);
    }
}

TEST(RayFilters, AllClassesAreTheWholeScene) {
    const ManyClasses many(40, 5);
    Random random(1);
    const LinkSet all = random_set(40, 2.0f, random), nothing(40);
    const auto bvh = build_bvh(many.scene);
    for (const geometry::Ray& ray : mixed_rays(5000, 3)) {
        EXPECT_TRUE(is_same(bvh->intersect_some(ray, all), bvh->intersect(ray)));
        EXPECT_EQ(bvh->is_occluded_by_some(ray, all), bvh->is_occluded(ray));
        EXPECT_FALSE(bvh->intersect_some(ray, nothing).is_valid());
        EXPECT_FALSE(bvh->is_occluded_by_some(ray, nothing));
    }
}

TEST(RayFilters, WhatIsNotMetIsAsIfItWereNotThere) {
    // Small, so that rays are made ready alike for both
    ManyClasses many(4, 8);
    many.scene.instances.clear();
    many.scene.classes.row_of_instance.clear();
    many.scene.shapes.resize(many.soups.size());
    many.scene.classes.of_shape.resize(many.soups.size());
    const Soup frame = box(Vec3(-1), Vec3(1));
    for (LinkClass c = 0; c < 4; ++c) {
        many.scene.shapes.push_back(frame.view());
        many.scene.classes.of_shape.push_back(c);
    }
    for (LinkClass c = 0; c < 4; ++c) {
        LinkSet met(4);
        met.add(c);
        const auto some = build_bvh(many.scene);
        const auto alone = build_bvh(only(many.scene, met));
        for (const geometry::Ray& ray : mixed_rays(3000, c))
            EXPECT_TRUE(is_same(some->intersect_some(ray, met), alone->intersect(ray)));
    }
}

TEST(RayFilters, MeetEveryClassOfExactDuplicates) {
    const Soup soup = random_soup(50, 0.5f, 1);
    SoupScene scene;
    for (int i = 0; i < 3; ++i) scene.shapes.push_back(soup.view());
    scene.classes.of_shape = {2, 0, 1};
    const auto bvh = build_bvh(scene);
    size_t hits = 0;
    for (const geometry::Ray& ray : mixed_rays(2000, 2)) {
        for (uint32_t shape = 0; shape < 3; ++shape) {
            LinkSet met(3);
            met.add(scene.classes.of_shape[shape]);
            const geometry::Hit hit = bvh->intersect_some(ray, met);
            EXPECT_EQ(hit.is_valid(), bvh->is_occluded(ray));
            if (hit.is_valid()) {
                EXPECT_EQ(hit.shape, shape);
            }
            hits += hit.is_valid();
        }
    }
    EXPECT_GT(hits, 100u);
}

TEST(RayFilters, ASceneWithoutClassesIsOfClassZero) {
    const Soup soup = random_soup(100, 0.5f, 4);
    SoupScene scene;
    scene.shapes.push_back(soup.view());
    const auto bvh = build_bvh(scene);
    LinkSet zero(2), one(2);
    zero.add(0);
    one.add(1);
    for (const geometry::Ray& ray : mixed_rays(1000, 6)) {
        EXPECT_TRUE(is_same(bvh->intersect_some(ray, zero), bvh->intersect(ray)));
        EXPECT_FALSE(bvh->intersect_some(ray, one).is_valid());
        EXPECT_FALSE(bvh->is_occluded_by_some(ray, one));
    }
}

}  // namespace
}  // namespace velatura::accel::test
