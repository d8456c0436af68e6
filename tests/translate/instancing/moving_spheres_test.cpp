// SPDX-License-Identifier: Apache-2.0
// Points that move each by itself, against closed forms.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <variant>

namespace velatura::translate::instancing {

namespace {

/// Seconds are 32 time codes: times of the tests below are exact in binary.
std::string stage_text(double close, const std::string& rows, const std::string& more = "") {
    return "#usda 1.0\n(\n timeCodesPerSecond = 32\n framesPerSecond = 32\n)\n" +
           camera(fmt::format("double shutter:open = 0\ndouble shutter:close = {}\n", close)) +
           "def DomeLight \"Sky\" {}\ndef Points \"D\" {\n" + rows + "}\n" + more;
}

const std::string dust = R"(
    point3f[] points.timeSamples = { 1: [(0, 0, -9), (2, 0, -9), (4, 0, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(32, 0, 0), (0, -64, 0), (0, 0, 0)] }
    float[] widths = [0.5, 0.25, 1]
)";

}  // namespace

TEST(MovingBalls, FollowTheirVelocities) {
    Translated t;
    translate_at(1,
                 stage_text(0.5, dust + "color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), "
                                        "(0, 0, 1)] (interpolation = \"vertex\")\n"),
                 t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    EXPECT_TRUE(t.scene.shapes.empty());
    ASSERT_EQ(t.scene.instances.size(), 3u);
    ASSERT_EQ(t.scene.prototypes.size(), 1u);
    const Vec3 ways[] = {{0.5f, 0, 0}, {0, -1, 0}, {0, 0, 0}};
    const float widths[] = {0.5f, 0.25f, 1.0f};
    for (size_t i = 0; i < 3; ++i) {
        const scene::Instance& instance = t.scene.instances[i];
        EXPECT_EQ(position(key(instance, 0)), Vec3(2.0f * float(i), 0, -9));
        ASSERT_EQ(instance.later_render_from_prototype.size(), i < 2 ? 1u : 0u);
        EXPECT_EQ(position(key(instance, i < 2)) - position(key(instance, 0)), ways[i]);
        EXPECT_EQ(key(instance, 0)[1][1], widths[i]);
        EXPECT_EQ(t.inherited(i, "displayColor"),
                  (std::vector<float>{float(i == 0), float(i == 1), float(i == 2)}));
    }
    const auto& ball = std::get<scene::Points>(t.scene.prototypes[0].shapes[0].geometry);
    EXPECT_EQ(ball.widths, std::vector<float>{1.0f});
    EXPECT_TRUE(ball.primvars.empty());
}

TEST(MovingBalls, GoFromSampleToSampleAndGrow) {
    Translated t;
    translate_at(1, stage_text(0.5, R"(
    point3f[] points.timeSamples = { 1: [(0, 0, -9), (2, 0, -9)], 2: [(4, 0, -9), (2, 0, -9)] }
    float[] widths.timeSamples = { 1: [0.5, 1], 2: [0.5, 3] }
    int64[] ids = [7, 9]
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (0, 8, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
)"),
                 t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        const scene::Instance& instance = t.scene.instances[i];
        ASSERT_EQ(instance.later_render_from_prototype.size(), 1u);
        EXPECT_EQ(position(key(instance, 1)), Vec3(2, 4, -9));
        EXPECT_EQ(key(instance, 1)[0][0], i == 0 ? 0.5f : 2.0f);
    }
}

TEST(MovingBalls, AreTheCloudOfTheFrameWhileTheShutterIsClosed) {
    Translated closed, still;
    translate_at(1, stage_text(0, dust), closed);
    ASSERT_EQ(closed.scene.shapes.size(), 1u);
    EXPECT_TRUE(closed.scene.instances.empty());
    translate_at(1, stage_text(0.5, "point3f[] points = [(0, 0, -9)]\nfloat[] widths = [1]\n"),
                 still);
    EXPECT_EQ(still.scene.shapes.size(), 1u);
}

TEST(MovingBalls, ThatCannotBeInstancesAreNamed) {
    const struct {
        const char* what;
        std::string rows;
    } cases[] = {
        {"other points",
         "point3f[] points.timeSamples = { 1: [(0, 0, -9)], 2: [(1, 0, -9)] }\nint64[] "
         "ids.timeSamples = { 1: [1], 2: [2] }\nfloat[] widths = [1]\n"},
        {"more points",
         "point3f[] points.timeSamples = { 1: [(0, 0, -9)], 1.25: [(1, 0, -9)], 1.5: [(1, 0, -9), "
         "(2, 0, -9)] }\nfloat[] widths = [1]\n"},
    };

    for (const auto& c : cases) {
        Translated t;
        translate_at(1, stage_text(0.5, c.rows), t);
        EXPECT_EQ(t.count("unsupported-motion-blur"), 1u) << c.what;
        EXPECT_EQ(t.scene.shapes.size(), 1u) << c.what;
        EXPECT_TRUE(t.scene.instances.empty()) << c.what;
    }
}

/// Each ball is an instance that hands its element down.
TEST(MovingBalls, BringTheirPrimvarsAlong) {
    const std::string reads = R"(def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness.connect = </M/R.outputs:result>
        token outputs:surface
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "age"
        float outputs:result
    }
}
)";
    Translated t;
    translate_at(1,
                 stage_text(0.5,
                            dust + "rel material:binding = </M>\nfloat[] primvars:age = [0, 0.5, "
                                   "1] (interpolation = \"vertex\")\n",
                            reads),
                 t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
    ASSERT_EQ(t.scene.instances.size(), 3u);
    for (size_t i = 0; i < 3; ++i)
        EXPECT_EQ(t.inherited(i, "age"), std::vector<float>{0.5f * float(i)});
}

TEST(MovingBalls, WithoutPlaceOrWidthAreLeftOut) {
    Translated t;
    translate_at(1, stage_text(0.5, R"(
    point3f[] points.timeSamples = { 1: [(0, 0, -9), (nan, 0, -9), (4, 0, -9)] }
    vector3f[] velocities.timeSamples = { 1: [(32, 0, 0), (0, -64, 0), (0, 0, 32)] }
    float[] widths = [0.5, 0.25, 0]
)"),
                 t);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    EXPECT_EQ(position(key(t.scene.instances[0], 1)), Vec3(0.5f, 0, -9));
    EXPECT_EQ(t.count("bad-points"), 1u);
}

}  // namespace velatura::translate::instancing
