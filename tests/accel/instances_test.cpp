// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh.h"
#include "accel/traverse.h"
#include "brute_force.h"
#include "compare.h"
#include "hard_case.h"
#include "soups.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::accel::test {
namespace {

Mat4d rotation(Random& random) {
    Mat4d m;
    m.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 2 * pi)));
    return m;
}

Mat4d scaling(double x, double y, double z) {
    Mat4d m;
    m.setScale(Vec3d(x, y, z));
    return m;
}

Mat4d translation(const Vec3& t) {
    Mat4d m;
    m.setTranslation(Vec3d(t));
    return m;
}

struct InstancedScene {
    std::vector<Soup> direct, prototypes;
    SoupScene scene;

    void finish() {
        for (const Soup& soup : direct) scene.shapes.push_back(soup.view());
        for (const Soup& soup : prototypes) scene.prototypes.push_back({soup.view(), soup.view()});
    }
};

// Nested, mirrored and very uneven placements among triangles placed directly.
InstancedScene make_scene() {
    InstancedScene s;
    s.direct = {random_soup(100, 0.2f, 1)};
    s.prototypes = {random_soup(60, 0.5f, 2), box(Vec3(-1), Vec3(1)), flat_triangles(60, 3),
                    star_mesh(6, 9, 1.0, 0.5, Vec3d(10, 0, 0), 4)};
    s.finish();
    Random random(5);
    for (uint32_t i = 0; i < 60; ++i) {
        Mat4d m = scaling(0.2, 0.2, 0.2);
        const uint32_t kind = i % 5;
        if (kind == 1) m = scaling(-0.2, 0.1, 0.3);
        if (kind == 2) m = scaling(1e-4, 1.0, 1.0) * rotation(random);
        if (kind == 3) m = m * rotation(random) * scaling(1.0, 1e-4, 0.3) * rotation(random);
        if (kind != 4) m = m * rotation(random) * translation(random.in_cube(1));
        if (kind == 4) m = m * translation(Vec3(float(int(random.below(5)) - 2) * 0.25f));
        s.scene.instances.push_back({i % 4, Mat4(m)});
    }
    return s;
}

TEST(Instances, FindWhatBruteForceFinds) {
    const InstancedScene s = make_scene();
    const auto rays = mixed_rays(5000, 6);
    const std::vector<geometry::Hit> expected = hits_of(BruteForce(s.scene), rays);
    for (const Kernels& kernels : all_kernels()) {
        BvhOptions options;
        options.kernels = &kernels;
        const auto bvh = build_bvh(s.scene, options);
        EXPECT_EQ(bvh->stats().instances, s.scene.instances.size());
        const Agreement agreement = compare(*bvh, expected, rays);
        EXPECT_EQ(agreement.different, 0u) << kernels.name << ", " << agreement.hits << " hits";
        EXPECT_EQ(agreement.different_occlusion, 0u) << kernels.name;
        EXPECT_GT(agreement.hits, 2000u);
    }
}

TEST(Instances, MeetRaysWhereTheirTrianglesLieInRenderSpace) {
    // Second method: the same triangles, placed by hand in double
    const InstancedScene s = make_scene();
    const auto bvh = build_bvh(s.scene);
    size_t compared = 0;
    for (const geometry::Ray& ray : mixed_rays(3000, 7)) {
        const geometry::Hit hit = bvh->intersect(ray);
        if (!hit.is_valid() || hit.instance == scene::none) continue;
        const SoupInstance& instance = s.scene.instances[hit.instance];
        const Soup& soup = s.prototypes[instance.prototype];
        const auto& v = soup.triangles[hit.triangle];
        const double w[3] = {1.0 - double(hit.b1) - double(hit.b2), double(hit.b1), double(hit.b2)};
        Vec3d p(0);
        double size = 0;
        for (size_t k = 0; k < 3; ++k) {
            const Vec3d corner =
                transform_point(Vec3d(soup.positions[v[k]]), Mat4d(instance.render_from_prototype));
            p += corner * w[k];
            size = std::max(size, corner.length());
        }
        const Vec3d on_ray = Vec3d(ray.o) + Vec3d(ray.d) * double(hit.t);
        EXPECT_LT((p - on_ray).length(), 1e-6 * (size + (on_ray - Vec3d(ray.o)).length()));
        ++compared;
    }
    EXPECT_GT(compared, 1000u);
}

TEST(Instances, OfAnIdentityWinTiesAgainstTheSameTrianglesPlacedDirectly) {
    InstancedScene s;
    s.direct = {random_soup(50, 0.5f, 8)};
    s.prototypes = s.direct;
    s.finish();
    s.scene.instances = {{0, Mat4()}, {0, Mat4()}, {0, Mat4()}};
    const auto bvh = build_bvh(s.scene);
    size_t hits = 0;
    for (const geometry::Ray& ray : mixed_rays(2000, 9)) {
        const geometry::Hit hit = bvh->intersect(ray);
        if (!hit.is_valid()) continue;
        ++hits;
        // Smallest (instance, shape, triangle); `none` is the largest instance
        EXPECT_EQ(hit.instance, 0u);
        EXPECT_EQ(hit.shape, 0u);
    }
    EXPECT_GT(hits, 200u);
}

TEST(H09SingularMatrices, OfInstancesAreNotHitAndHarmOthersNot) {
    InstancedScene s = make_scene();
    const auto expected = build_bvh(s.scene);
    const size_t good = s.scene.instances.size();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, inf, 0.0f, 1e38f}) {
        Mat4 m;
        m[0][0] = bad;
        if (bad == 1e38f) m[3][0] = 3e38f;
        s.scene.instances.push_back({1, m});
    }
    const auto bvh = build_bvh(s.scene);
    EXPECT_EQ(bvh->stats().instances, good);
    hardcase::expect_within({"hits of 2000 rays that unusable matrices change",
                             double(compare(*bvh, *expected, mixed_rays(2000, 10)).different), 0, 0,
                             "the scene without them"});
}

/// How many of 2000 rays meet something else when the whole scene is 2^exponent times its size.
size_t count_changed_by_scale(int exponent) {
    const InstancedScene s = make_scene();
    const float k = std::ldexp(1.0f, exponent);
    InstancedScene scaled = make_scene();
    for (Soup& soup : scaled.direct) {
        for (Vec3& p : soup.positions) p *= k;
    }
    for (SoupInstance& instance : scaled.scene.instances) {
        for (int i = 0; i < 4; ++i) {
            for (int j = 0; j < 3; ++j) instance.render_from_prototype[i][j] *= k;
        }
    }
    const auto bvh = build_bvh(s.scene), scaled_bvh = build_bvh(scaled.scene);
    size_t different = 0;
    for (const geometry::Ray& ray : mixed_rays(2000, 11)) {
        different +=
            !is_same(scaled_bvh->intersect({ray.o * k, ray.d * k, ray.t_max}), bvh->intersect(ray));
    }
    return different;
}

TEST(Instances, KeepBitsUnderScalingByPowersOfTwo) {
    for (const int exponent : {-20, 20})
        EXPECT_EQ(count_changed_by_scale(exponent), 0u) << "2^" << exponent;
}

TEST(H09SingularMatrices, DeterminantsBeyondFloatsAreNone) {
    for (const int exponent : {-41, 41}) {
        hardcase::expect_within(
            {fmt::format("hits of 2000 rays that determinants of about {:.0e} change",
                         0.008 * std::ldexp(1.0, 3 * exponent)),
             double(count_changed_by_scale(exponent)), 0, 0, "the scene in its size, bit for bit"});
    }
}

}  // namespace
}  // namespace velatura::accel::test
