// SPDX-License-Identifier: Apache-2.0
// Grids of bricks against the numbers that they were made of, and walks through them.
#include "../sampling/chi_square.h"
#include "grid_fixtures.h"
#include "media/brick_walk.h"
#include "media/voxel_lookup.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::media {
namespace {

using sampling::testing::TestRandom;
using scene::VoxelGrid;
using testing::make_voxel_grid;

/// A number for a lattice point; most of space is 0.
float number_of(int x, int y, int z) {
    const int blob = (x / 24 + 3 * (y / 24) + 5 * (z / 24)) % 4;
    if (blob != 0) return 0.0f;
    return float((x * 7 + y * 13 + z * 29) % 17) / 4.0f;
}

constexpr int size_x = 150, size_y = 70, size_z = 33;

VoxelGrid blobs() {
    return make_voxel_grid(Vec3i(size_x, size_y, size_z), 1.0f, number_of);
}

double brute_force(const Vec3d& p) {
    const Vec3d cell(std::floor(p.x), std::floor(p.y), std::floor(p.z));
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
        const Vec3i at(int(cell.x) + (i & 1), int(cell.y) + (i >> 1 & 1), int(cell.z) + (i >> 2));
        if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= size_x || at.y >= size_y || at.z >= size_z)
            continue;
        double weight = 1;
        for (int a = 0; a < 3; ++a) {
            const double rest = p[a] - cell[a];
            weight *= at[a] == int(cell[a]) ? 1 - rest : rest;
        }
        sum += weight * double(number_of(at.x, at.y, at.z));
    }
    return sum;
}

}  // namespace

TEST(VoxelGrid, GivesTheInterpolatedNumbers) {
    const VoxelGrid grid = blobs();
    Mat4d lattice_from_volume = grid.volume_from_lattice.inverse();
    TestRandom random(1);
    for (int i = 0; i < 20000; ++i) {
        const Vec3d p(random.uniform() * (size_x + 20) - 10, random.uniform() * (size_y + 20) - 10,
                      random.uniform() * (size_z + 20) - 10);
        EXPECT_NEAR(double(number_at(grid, to_float(transform_point(p, lattice_from_volume)))),
                    brute_force(p), 2e-4);
    }
    EXPECT_EQ(number_at(grid, Vec3(-1e30f, 0, 0)), 0.0f);
    EXPECT_EQ(number_at(grid, Vec3(std::numeric_limits<float>::quiet_NaN())), 0.0f);
    EXPECT_EQ(number_at(grid, Vec3(1e30f)), 0.0f);
}

TEST(VoxelGrid, KeepsNoBricksOfEmptySpace) {
    const VoxelGrid grid = blobs();
    EXPECT_LT(grid.values.size() / VoxelGrid::brick_values(1), 21u * 11u * 7u * 3 / 4);
    EXPECT_EQ(grid.max(), 4.0f);
    for (const VoxelGrid::Brick& brick : grid.bricks) {
        if (brick.is_constant()) continue;
        for (size_t i = 0; i < VoxelGrid::brick_values(1); ++i) {
            EXPECT_GE(grid.values[brick.first_value + i], brick.min);
            EXPECT_LE(grid.values[brick.first_value + i], brick.max);
        }
    }
}

TEST(VoxelGrid, TakesWhatIsNoDensityForNone) {
    const float bad[] = {-1.0f, std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity()};
    const VoxelGrid grid =
        make_voxel_grid(Vec3i(3, 1, 1), 1.0f, [&](int x, int, int) { return bad[x]; });
    EXPECT_EQ(grid.max(), 0.0f);
    EXPECT_TRUE(grid.values.empty());
}

TEST(BrickWalk, FindsEveryBrickOnTheWay) {
    const VoxelGrid grid = blobs();
    TestRandom random(2);
    for (int i = 0; i < 3000; ++i) {
        // Also along axes and diagonals, from inside and outside
        Vec3 o, d;
        for (int a = 0; a < 3; ++a) {
            o[a] = float(random.uniform() * 200 - 20);
            d[a] =
                i % 3 == 0 ? float(int(random.uniform() * 3) - 1) : float(random.uniform() * 2 - 1);
        }
        if (d == Vec3(0.0f)) continue;
        float begin = 0, end = 1e6f;
        if (!clip_to_box(grid.box_min, grid.box_max, o, d, begin, end)) continue;
        BrickWalk walk(grid, o, d, begin, end);
        BrickSpan span;
        float t = begin;
        int spans = 0;
        while (walk.next(span)) {
            ++spans;
            EXPECT_EQ(span.begin, t);
            EXPECT_GE(span.end, span.begin);
            t = span.end;
            // In the middle of the span the brick is the one that a lookup there finds
            const float middle = 0.5f * (span.begin + span.end);
            if (span.end - span.begin < 1e-3f) continue;
            const Vec3 p = o + d * middle;
            EXPECT_EQ(number_at(grid, p),
                      number_in(grid, *span.brick,
                                span.brick->is_constant() ? Vec3(0.0f) : p - span.first));
        }
        EXPECT_EQ(t, end) << "ray " << i;
        EXPECT_LT(spans, 100);
    }
}

}  // namespace velatura::media
