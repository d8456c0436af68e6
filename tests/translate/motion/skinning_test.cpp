// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/skinning.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace velatura::translate::motion {

namespace {

Mat4d rotation_z(double degrees) {
    const double c = std::cos(degrees * pi_d / 180), s = std::sin(degrees * pi_d / 180);
    return Mat4d(c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
}

Mat4d rotation_x(double degrees) {
    const double c = std::cos(degrees * pi_d / 180), s = std::sin(degrees * pi_d / 180);
    return Mat4d(1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, 0, 0, 1);
}

Mat4d translation(double x, double y, double z) {
    return Mat4d(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1);
}

Mat4d scaling(double x, double y, double z) {
    return Mat4d(x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1);
}

Skin two_joints(const Mat4d& a, const Mat4d& b, double weight_of_b, SkinningMethod method) {
    Skin skin;
    skin.joints = {a, b};
    skin.influences = 2;
    skin.indices = {0, 1};
    skin.weights = {1.0 - weight_of_b, weight_of_b};
    skin.method = method;
    return skin;
}

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance = 1e-14) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

constexpr std::array methods = {SkinningMethod::ClassicLinear, SkinningMethod::DualQuaternion};

}  // namespace

TEST(Skinner, OneJointMovesAsItsMatrix) {
    const Mat4d m = rotation_x(33) * rotation_z(-71) * translation(3, -2, 0.5);
    const Vec3d p(0.3, 1.7, -2.2);
    for (const SkinningMethod method : methods) {
        const Skin skin = two_joints(m, Mat4d(), 0.0, method);
        expect_near(Skinner(skin).point(0, p), transform_point(p, m));
        expect_near(transform_point(p, Skinner(skin).matrix(0)), transform_point(p, m));
    }
}

TEST(Skinner, LinearBlendAveragesWhereTheJointsTakeThePoint) {
    const Skin skin = two_joints(Mat4d(), rotation_z(90), 0.25, SkinningMethod::ClassicLinear);
    expect_near(Skinner(skin).point(0, Vec3d(2, 0, 5)), Vec3d(1.5, 0.5, 5));
}

TEST(Skinner, DualQuaternionsKeepTheDistanceFromTheAxis) {
    // Linear blending of a twist by 180° collapses the point onto the axis
    const Skin linear = two_joints(Mat4d(), rotation_z(180), 0.5, SkinningMethod::ClassicLinear);
    expect_near(Skinner(linear).point(0, Vec3d(2, 0, 1)), Vec3d(0, 0, 1));
    for (const double degrees : {10.0, 90.0, 170.0}) {
        const Skin dual =
            two_joints(Mat4d(), rotation_z(degrees), 0.5, SkinningMethod::DualQuaternion);
        const Vec3d half = transform_point(Vec3d(2, 0, 1), rotation_z(degrees / 2));
        expect_near(Skinner(dual).point(0, Vec3d(2, 0, 1)), half);
    }
}

TEST(Skinner, DualQuaternionsOfScrewsGiveTheScrewInBetween) {
    // A screw along z: turn and advance go together
    const Skin skin = two_joints(Mat4d(), rotation_z(80) * translation(0, 0, 4), 0.5,
                                 SkinningMethod::DualQuaternion);
    expect_near(Skinner(skin).point(0, Vec3d(1, 0, 0)),
                transform_point(Vec3d(1, 0, 0), rotation_z(40) * translation(0, 0, 2)));
}

TEST(Skinner, DualQuaternionsBlendScaleLinearly) {
    const Skin skin = two_joints(scaling(1, 1, 1), scaling(3, 1, 1) * rotation_z(60), 0.5,
                                 SkinningMethod::DualQuaternion);
    expect_near(Skinner(skin).point(0, Vec3d(1, 0, 0)),
                transform_point(Vec3d(2, 0, 0), rotation_z(30)));
}

TEST(Skinner, MirroringJointMirrorsInBothMethods) {
    const Mat4d m = scaling(-1, 2, 1) * rotation_x(20) * translation(1, 0, 0);
    for (const SkinningMethod method : methods) {
        const Skin skin = two_joints(m, Mat4d(), 0.0, method);
        expect_near(Skinner(skin).point(0, Vec3d(1, 2, 3)), transform_point(Vec3d(1, 2, 3), m));
    }
}

TEST(Skinner, JointsAtRestLeaveEveryBit) {
    for (const SkinningMethod method : methods) {
        // The weights add up to 1 only within rounding
        Skin skin = two_joints(Mat4d(), Mat4d(), 1.0 / 3.0, method);
        skin.weights = {double(0.1f), double(0.9f)};
        const Vec3d p(1.0 / 3.0, 1e7 + 0.1, -1e-7 / 3.0);
        const Skinner skinner(skin);
        EXPECT_EQ(skinner.point(0, p), p);
        EXPECT_EQ(skinner.normal(0, p), p);
        EXPECT_EQ(skinner.matrix(0), Mat4d());
    }
}

TEST(Skinner, WeightsThatDoNotAddUpCountAsTheyAre) {
    Skin skin = two_joints(Mat4d(), translation(0, 2, 0), 0.5, SkinningMethod::ClassicLinear);
    skin.weights = {0.25, 0.25};
    expect_near(Skinner(skin).point(0, Vec3d(4, 0, 0)), Vec3d(2, 0.5, 0));
}

TEST(Skinner, NormalsStayPerpendicular) {
    // Plane x + y = 0 under a stretch along x and a turn: its tangents stay tangents
    const Mat4d m = scaling(5, 1, 1) * rotation_z(35);
    for (const SkinningMethod method : methods) {
        Skin skin = two_joints(m, Mat4d(), 0.0, method);
        skin.geom_bind = scaling(1, 3, 1) * rotation_x(50) * translation(1, 2, 3);
        const Skinner skinner(skin);
        const Vec3d p(0.5, -0.5, 2), n = skinner.normal(0, Vec3d(1, 1, 0));
        const Vec3d base = skinner.point(0, p);
        EXPECT_NEAR(n.dot(skinner.point(0, p + Vec3d(1, -1, 0)) - base), 0, 1e-13);
        EXPECT_NEAR(n.dot(skinner.point(0, p + Vec3d(0, 0, 1)) - base), 0, 1e-13);
        EXPECT_GT(n.dot(skinner.point(0, p + Vec3d(1, 1, 0)) - base), 0);
    }
}

TEST(BlendFactors, ArePiecewiseLinearThroughBaseInBetweensAndShape) {
    // Offsets along one axis: base 0 at 0, 10 at weight 0.25, 4 at weight 1
    const std::array<double, 2> weights = {0.25, 1.0};
    const std::array<double, 2> offsets = {10.0, 4.0};
    const auto value = [&](double w) {
        double sum = 0.0;
        for (const auto& [i, factor] : blend_factors(weights, w)) sum += offsets[i] * factor;
        return sum;
    };
    EXPECT_EQ(value(0.0), 0.0);
    EXPECT_EQ(value(0.25), 10.0);
    EXPECT_EQ(value(1.0), 4.0);
    EXPECT_DOUBLE_EQ(value(0.125), 5.0);
    EXPECT_DOUBLE_EQ(value(0.625), 7.0);
    // Beyond the ends the last pieces go on
    EXPECT_DOUBLE_EQ(value(1.75), -2.0);
    EXPECT_DOUBLE_EQ(value(-0.25), -10.0);
}

TEST(BlendFactors, NegativeInBetweensStandBeforeTheBase) {
    const std::array<double, 2> weights = {-0.5, 1.0};
    const auto at_minus_quarter = blend_factors(weights, -0.25);
    ASSERT_EQ(at_minus_quarter.size(), 1u);
    EXPECT_EQ(at_minus_quarter[0], (std::pair<size_t, double>(0, 0.5)));
    const auto at_half = blend_factors(weights, 0.5);
    ASSERT_EQ(at_half.size(), 1u);
    EXPECT_EQ(at_half[0], (std::pair<size_t, double>(1, 0.5)));
    EXPECT_TRUE(blend_factors(weights, 0.0).empty());
}

TEST(BlendFactors, WithoutInBetweensTheWeightIsTheFactor) {
    const std::array<double, 1> weights = {1.0};
    for (const double w : {-2.0, 0.3, 1.0, 7.0}) {
        const auto factors = blend_factors(weights, w);
        ASSERT_EQ(factors.size(), 1u);
        EXPECT_EQ(factors[0].second, w);
    }
}

}  // namespace velatura::translate::motion
