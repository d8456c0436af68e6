// SPDX-License-Identifier: Apache-2.0
// Boxes of placed prototypes: they hold what a ray can be found to meet, and fit turned prototypes
// closely.
#include "accel/placement.h"

#include "accel/bvh_builder.h"
#include "accel/bvh_collapse.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::accel {
namespace {

using test::Random;

WideTree tree_of(const std::vector<Vec3>& points, float half) {
    BuildPrims prims(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        BuildPrim prim{};
        prim.id = uint32_t(i);
        for (int k = 0; k < 3; ++k) {
            prim.lower[k] = points[i][k] - half;
            prim.upper[k] = points[i][k] + half;
        }
        prims.push_back(prim);
    }
    return collapse_to_ids(build_binary_tree(std::move(prims), {}));
}

std::vector<Vec3> ball(size_t count, uint64_t seed) {
    Random random(seed);
    std::vector<Vec3> points;
    for (size_t i = 0; i < count; ++i) points.push_back(random.direction());
    return points;
}

bool holds(const Box3& box, const Vec3& p) {
    return box.intersects(p);
}

TEST(Outline, HoldsWhatTheTreeHoldsInAsManyBoxesAsAskedFor) {
    const std::vector<Vec3> points = ball(5000, 1);
    const WideTree tree = tree_of(points, 0.01f);
    for (const size_t max : {size_t(1), size_t(8), size_t(64), size_t(1000), size_t(100000)}) {
        const std::vector<Box3> boxes = outline(tree, max);
        EXPECT_LE(boxes.size(), max + wide - 1);
        EXPECT_GE(boxes.size(), std::min(max, points.size()));
        for (const Vec3& p : points) {
            EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(), [&](const Box3& box) {
                return holds(box, p - Vec3(0.01f)) && holds(box, p + Vec3(0.01f));
            }));
        }
    }
    EXPECT_TRUE(outline({}, 64).empty());
}

// Against the corners of all boxes in long double, for maps that squeeze, turn and throw far off.
TEST(Placement, HoldsTheImageOfEveryBox) {
    const std::vector<Vec3> points = ball(2000, 2);
    const std::vector<Box3> boxes = outline(tree_of(points, 0.0f), 64);
    Random random(3);
    for (int i = 0; i < 1000; ++i) {
        Mat4 m;
        const float far = std::pow(10.0f, random.between(-3, 6));
        for (int row = 0; row < 3; ++row) {
            const Vec3 axis = random.direction() * std::pow(10.0f, random.between(-4, 4));
            for (int k = 0; k < 3; ++k) m[row][k] = axis[k];
            m[3][row] = random.between(-far, far);
        }
        PlacedBox placed, loose;
        const Box3 whole(Vec3(-1), Vec3(1));
        ASSERT_TRUE(place(m, boxes, placed));
        ASSERT_TRUE(place(m, {&whole, 1}, loose));
        for (const Box3& box : boxes) {
            for (int corner = 0; corner < 8; ++corner) {
                for (int k = 0; k < 3; ++k) {
                    long double x = m[3][k];
                    for (int j = 0; j < 3; ++j)
                        x += static_cast<long double>((corner >> j & 1) ? box.max[j] : box.min[j]) *
                             static_cast<long double>(m[j][k]);
                    ASSERT_LE(placed.lower[k], double(x));
                    ASSERT_GE(placed.upper[k], double(x));
                }
            }
        }
        for (int k = 0; k < 3; ++k) {
            EXPECT_GE(placed.lower[k], loose.lower[k]);
            EXPECT_LE(placed.upper[k], loose.upper[k]);
        }
    }
}

TEST(Placement, FitsATurnedBallCloselyWithAnOutline) {
    const WideTree tree = tree_of(ball(20000, 4), 0.0f);
    Mat4 turned;
    turned.rotate(Vec3(0.5f, 0.7f, 0.3f));
    PlacedBox one, many, max;
    ASSERT_TRUE(place(turned, outline(tree, 1), one));
    ASSERT_TRUE(place(turned, outline(tree, 64), many));
    ASSERT_TRUE(place(turned, outline(tree, 2048), max));
    for (int k = 0; k < 3; ++k) {
        EXPECT_GT(one.upper[k], 1.35);  // the corners of its box
        EXPECT_LT(many.upper[k], 1.3);
        EXPECT_LT(max.upper[k], 1.1);
        EXPECT_GT(max.upper[k], 0.99);
        EXPECT_LT(max.lower[k], -0.99);
    }
}

}  // namespace
}  // namespace velatura::accel
