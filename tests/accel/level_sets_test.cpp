// SPDX-License-Identifier: Apache-2.0
// Level sets against the sphere that they sample, against their own numbers along rays, and rays
// that aim at the edges of voxels and bricks.
#include "../media/grid_fixtures.h"
#include "accel/bvh.h"
#include "brute_force.h"
#include "compare.h"
#include "geometry/geometry_set.h"
#include "geometry/level_set.h"
#include "geometry/mapped_set.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>

namespace velatura::accel::test {
namespace {

using geometry::LevelSet;
using geometry::PrimitiveHit;
using geometry::PrimitiveSurface;
using scene::VoxelGrid;

constexpr float far_away = 1e30f;

using Field = std::function<double(const Vec3d&)>;

/// A field at n³ points in the box [-1.5, 1.5]³, cut off as narrow bands of three voxels are.
std::shared_ptr<const VoxelGrid> sampled(int n, const Field& field) {
    const double h = 3.0 / (n - 1);
    const auto number = [&](int x, int y, int z) {
        const double f = field(Vec3d(x, y, z) * h - Vec3d(1.5));
        return float(std::clamp(f, -3 * h, 3 * h));
    };
    VoxelGrid grid =
        media::testing::make_voxel_grid(scene::Vec3i(n), float(h), number, float(3 * h), true);
    Mat4d moved;
    moved.translate(Vec3d(-1.5));
    grid.volume_from_lattice = grid.volume_from_lattice * moved;
    return std::make_shared<const VoxelGrid>(std::move(grid));
}

std::shared_ptr<const VoxelGrid> ball(int n) {
    return sampled(n, [](const Vec3d& p) { return p.length() - 1.0; });
}

/// Lumps and tunnels.
Field lumps(uint64_t seed) {
    Random random(seed);
    const Vec3d a = Vec3d(random.in_cube(1)) * 2.0 + Vec3d(4.0), b = Vec3d(random.in_cube(1)) * 3.0;
    return [a, b](const Vec3d& p) {
        const double waves = std::sin(a.x * p.x + b.x) * std::sin(a.y * p.y + b.y) +
                             std::sin(a.z * p.z + b.z) * std::cos(a.x * p.x);
        return 0.15 * waves + 0.3 * (p.length() - 1.0);
    };
}

scene::Scene scene_of(std::shared_ptr<const VoxelGrid> grid, const Mat4d& placed = Mat4d()) {
    scene::Scene scene;
    scene.shapes.emplace_back();
    const Mat4d map = grid->volume_from_lattice * placed;
    scene.shapes[0].geometry = scene::LevelSet{std::move(grid), map, {}};
    return scene;
}

/// Of all bricks, one by one.
std::optional<PrimitiveHit> first_hit(const geometry::PrimitiveSet& set,
                                      const Vec3d& o,
                                      const Vec3d& d,
                                      uint32_t& brick) {
    std::optional<PrimitiveHit> first;
    for (uint32_t i = 0; i < set.size(); ++i) {
        const auto hit = set.intersect(i, o, d, first ? float(first->t) : far_away);
        if (!hit) continue;
        first = hit;
        brick = i;
    }
    return first;
}

/// The numbers of a grid, looked up without bricks.
class Numbers {
  public:
    explicit Numbers(const VoxelGrid& grid) : grid_(grid) {}

    double operator()(const Vec3d& p) const {
        double sum = 0;
        const Vec3d low(std::floor(p.x), std::floor(p.y), std::floor(p.z)), f = p - low;
        for (int i = 0; i < 8; ++i) {
            const scene::Vec3i c(int(low.x) + (i & 1), int(low.y) + (i >> 1 & 1),
                                 int(low.z) + (i >> 2));
            sum +=
                (i & 1 ? f.x : 1 - f.x) * (i & 2 ? f.y : 1 - f.y) * (i & 4 ? f.z : 1 - f.z) * at(c);
        }
        return sum;
    }

  private:
    double at(const scene::Vec3i& point) const {
        constexpr int cells = VoxelGrid::brick_cells, n = VoxelGrid::node_bricks;
        for (int a = 0; a < 3; ++a)
            if (point[a] < 0 || point[a] >= grid_.node_count[a] * cells * n)
                return double(grid_.bricks[0].min);
        const scene::Vec3i brick = point / cells, in = point - brick * cells, node = brick / n;
        const uint32_t entry = grid_.nodes[size_t(
            (node.z * grid_.node_count.y + node.y) * grid_.node_count.x + node.x)];
        uint32_t id = entry;
        if (entry & VoxelGrid::is_node)
            id = grid_.node_entries[entry & ~VoxelGrid::is_node]
                                   [size_t((brick.z % n * n + brick.y % n) * n + brick.x % n)];
        const VoxelGrid::Brick& b = grid_.bricks[id];
        if (b.is_constant()) return double(b.min);
        constexpr int points = VoxelGrid::brick_points;
        return double(grid_.values[b.first_value + size_t((in.z * points + in.y) * points + in.x)]);
    }

    const VoxelGrid& grid_;
};

}  // namespace

TEST(LevelSets, AreTheSphereThatTheySample) {
    double last = 0;
    for (const int n : {25, 49, 97}) {
        const auto grid = ball(n);
        const auto set = geometry::MappedSet::make(LevelSet::make(grid), grid->volume_from_lattice);
        const double h = 3.0 / (n - 1);
        Random random(1);
        double farthest = 0, steepest = 0;
        int hits = 0;
        for (int i = 0; i < 4000; ++i) {
            const Vec3d o = Vec3d(random.direction()) * 3.0;
            const Vec3d d = normalize(Vec3d(random.direction()) * 0.9 - o);
            const double b = o.dot(d), square = b * b - (o.dot(o) - 1.0);
            ASSERT_GT(square, 0.0);
            uint32_t brick = 0;
            const auto hit = first_hit(*set, o, d, brick);
            ASSERT_TRUE(hit);
            const double exact = -b - std::sqrt(square);
            const double cosine = std::sqrt(square);
            farthest = std::max(farthest, std::abs(hit->t - exact) * cosine);
            const PrimitiveSurface at = set->surface(brick, o, d, *hit);
            EXPECT_LT((at.p - (o + d * hit->t)).length(), 1e-12);
            steepest = std::max(steepest, normalize(at.n).cross(normalize(at.p)).length());
            EXPECT_GT(at.n.dot(at.p), 0.0);
            ++hits;
        }
        std::printf("%d hits, voxels of %.4f: off by %.2e = %.2e voxels, normals by %.2e\n", hits,
                    h, farthest, farthest / h, steepest);
        // Trilinear: h²/8 times the sum of the curvatures, 2
        EXPECT_LT(farthest, 0.26 * h * h);
        if (last > 0) {
            EXPECT_NEAR(last / farthest, 4.0, 0.6);
        }
        last = farthest;
        EXPECT_LT(steepest, 1.5 * h * h);
    }
}

TEST(LevelSets, AreWhereTheirNumbersChangeSides) {
    size_t hits = 0, tested = 0;
    for (uint64_t seed = 1; seed <= 6; ++seed) {
        const auto grid = sampled(41, lumps(seed));
        const auto set = LevelSet::make(grid);
        ASSERT_TRUE(set);
        const Numbers number(*grid);
        Random random(seed);
        for (int i = 0; i < 300; ++i) {
            const Vec3d center(28.0), o = center + Vec3d(random.direction()) * 45.0;
            const Vec3d d = center + Vec3d(random.in_cube(1)) * 18.0 - o;
            // Steps of 1/100 of a voxel until sides change
            const double step = 0.01 / d.length();
            double t = 0;
            while (t < 4.0 && !(number(o + d * t) < 0.0)) t += step;
            uint32_t brick = 0;
            const auto hit = first_hit(*set, o, d, brick);
            ++tested;
            if (t >= 4.0) {
                // Between two steps the ray may have been inside for a moment
                if (hit) {
                    EXPECT_GT(number(o + d * (hit->t + step)), 0.0);
                }
                continue;
            }
            ++hits;
            ASSERT_TRUE(hit) << seed << " " << i;
            EXPECT_LE(hit->t, t + 1e-12);
            EXPECT_NEAR(number(o + d * hit->t), 0.0, 1e-12);
            if (hit->t < t - step) {
                EXPECT_GT(number(o + d * (hit->t + step)), 0.0);
            }
        }
    }
    std::printf("%zu hits of %zu rays\n", hits, tested);
    EXPECT_GT(hits, 900u);
}

TEST(LevelSets, TreesFindWhatBruteForceFinds) {
    Mat4d turned, scaled;
    turned.rotate(Vec3d(0.3, 0.7, -0.2));
    scaled.setScale(Vec3d(-0.7, 0.4, 1.1));
    for (const Mat4d& placed : {Mat4d(), turned, scaled * turned}) {
        const scene::Scene scene = scene_of(sampled(41, lumps(3)), placed);
        const geometry::GeometrySet geometry(scene);
        const SoupScene soup = make_soup(scene, geometry);
        Random random(5);
        std::vector<geometry::Ray> rays;
        for (int i = 0; i < 4000; ++i) {
            const Vec3 o = random.direction() * (i % 2 ? 4.0f : 0.5f);
            rays.push_back({o, random.in_cube(1) - o});
        }
        const std::vector<geometry::Hit> expected = hits_of(BruteForce(soup), rays);
        const Agreement agreement = compare(*build_bvh(soup), expected, rays);
        EXPECT_EQ(agreement.different, 0u);
        EXPECT_EQ(agreement.different_occlusion, 0u);
        EXPECT_GT(agreement.hits, 2000u);
    }
}

/// From outside to inside, along and across the lines and planes between voxels and bricks.
TEST(LevelSets, LetNothingThrough) {
    constexpr int n = 49;
    const auto grid = ball(n);
    Mat4d turned;
    turned.rotate(Vec3d(0.3, 0.7, -0.2));
    const auto set = LevelSet::make(grid);
    // In lattice coordinates, where lines of voxels are exact, and turned
    scene::Scene exact;
    exact.shapes.emplace_back();
    exact.shapes[0].geometry = scene::LevelSet{grid, Mat4d(), {}};
    scene::Scene placed = scene_of(grid, turned);
    const geometry::GeometrySet exact_geometry(exact), placed_geometry(placed);
    const auto exact_tree = build_bvh(exact, exact_geometry);
    const auto placed_tree = build_bvh(placed, placed_geometry);
    const Mat4d map = grid->volume_from_lattice * turned;
    const Vec3d middle(32.0);  // of the ball of 16 voxels around
    Random random(9);
    size_t rays = 0, leaks = 0, placed_leaks = 0;
    constexpr int directions[3] = {-1, 0, 1};
    for (int i = 0; i < 500000; ++i) {
        // A point of the lattice well inside, or on a line or plane of it
        Vec3d inside;
        for (int a = 0; a < 3; ++a)
            inside[a] = std::round(32.0 + 8.0 * (2.0 * double(random.between(0, 1)) - 1.0));
        const bool is_on_brick = i % 3 == 0;
        if (is_on_brick) inside[i / 3 % 3] = 32.0;
        if (i % 5 == 1) inside[i % 3] += double(random.between(-0.5f, 0.5f));
        // Along axes, diagonals, in planes, anyhow
        Vec3d d(0.0);
        if (i % 4 < 2) {
            while (d == Vec3d(0.0))
                for (int a = 0; a < 3; ++a) d[a] = directions[random.below(3)];
        } else {
            d = Vec3d(random.direction());
            if (i % 4 == 2) d[i % 3] = 0.0;
        }
        if ((inside - middle).length() > 14.5 || d.length() < 1e-3) continue;
        const double reach = std::exp2(std::ceil(std::log2(48.0 / d.length())));
        const Vec3 o(inside + d * reach), end(inside);
        const geometry::Ray ray{o, end - o, 1.0f};
        ++rays;
        leaks += !exact_tree->is_occluded(ray) || !exact_tree->intersect(ray).is_valid();
        const Vec3 o2 = to_float(transform_point(Vec3d(o), map));
        const Vec3 end2 = to_float(transform_point(Vec3d(end), map));
        const geometry::Ray ray2{o2, end2 - o2, 1.0f};
        ++rays;
        placed_leaks += !placed_tree->is_occluded(ray2);
    }
    std::printf("%zu rays, %zu + %zu leaks\n", rays, leaks, placed_leaks);
    EXPECT_GE(rays, 900000u);
    EXPECT_EQ(leaks + placed_leaks, 0u);
}

TEST(LevelSets, NormalsTurnAsTheySay) {
    const auto set = LevelSet::make(sampled(41, lumps(2)));
    Random random(4);
    int tested = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3d center(28.0), o = center + Vec3d(random.direction()) * 45.0;
        const Vec3d d = normalize(center + Vec3d(random.in_cube(1)) * 15.0 - o);
        uint32_t brick = 0;
        const auto hit = first_hit(*set, o, d, brick);
        if (!hit) continue;
        const PrimitiveSurface at = set->surface(brick, o, d, *hit);
        EXPECT_GT(at.n.dot(at.facet_n), 0.0);
        const geometry::PrimitiveBounds bounds = set->bounds(brick);
        EXPECT_TRUE(bounds.box.intersects(at.p));
        // The same voxel a little aside
        const Vec3d o2 = o + at.n.cross(Vec3d(random.direction())) * 1e-6;
        const auto other = set->intersect(brick, o2, d, far_away);
        if (!other || std::abs(other->t - hit->t) > 1e-4) continue;
        const PrimitiveSurface there = set->surface(brick, o2, d, *other);
        const auto cell = [](const Vec3d& p) {
            return Vec3d(std::floor(p.x), std::floor(p.y), std::floor(p.z));
        };
        if (cell(there.p) != cell(at.p)) continue;
        const Vec3d said = (there.p - at.p) * at.normal_by_p, turned = there.n - at.n;
        EXPECT_LT((turned - said).length(), 1e-3 * said.length() + 1e-13);
        ++tested;
    }
    EXPECT_GT(tested, 1000);
}

TEST(LevelSets, RaysThatLeaveDoNotMeetWhatTheyLeft) {
    Mat4d scaled, moved;
    scaled.setScale(Vec3d(3.0, 0.7, 1.3));
    moved.translate(Vec3d(40, -20, 70));
    const scene::Scene scene = scene_of(ball(49), scaled * moved);
    const geometry::GeometrySet geometry(scene);
    const auto tree = build_bvh(scene, geometry);
    Random random(6);
    size_t left = 0, again = 0, through = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 o = Vec3(40, -20, 70) + random.direction() * 8.0f;
        const geometry::Ray ray{o, Vec3(40, -20, 70) + random.in_cube(0.4f) - o};
        const geometry::Hit hit = tree->intersect(ray);
        if (!hit.is_valid()) continue;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(scene, geometry, ray, hit);
        EXPECT_LT(point.ng.dot(ray.d), 0.0f);
        EXPECT_GT(point.ng.dot(point.ns), 0.9f);
        const Vec3 out = normalize(point.ng * 0.3f + random.direction() * 0.2f);
        again += tree->intersect(geometry::spawn_ray(point, out)).is_valid();
        through += tree->intersect(geometry::spawn_ray(point, -out)).is_valid();
        ++left;
    }
    std::printf("%zu rays left outwards, %zu met it again; inwards %zu met the other side\n", left,
                again, through);
    EXPECT_GT(left, 15000u);
    EXPECT_EQ(again, 0u);
    EXPECT_EQ(through, left);
}

}  // namespace velatura::accel::test
