// SPDX-License-Identifier: Apache-2.0
// What is no mesh and moves as a whole: an instance of itself.
#include "translate/support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <variant>

namespace velatura::translate::instancing {

namespace {

const char* const half_a_frame = "double shutter:open = 0\ndouble shutter:close = 0.5\n";

/// 4 units along x in half a frame.
const std::string moves =
    "double3 xformOp:translate.timeSamples = { 1: (0, 0, -9), 2: (8, 0, -9) }\nuniform token[] "
    "xformOpOrder = [\"xformOp:translate\"]\n";

void translate_seen(const std::string& shutter, const std::string& text, Translated& out) {
    TranslateOptions options;
    options.time = 1.0;
    translate_text(camera(shutter) + text, out, options);
    ASSERT_EQ(out.error, "") << out.error_message;
}

std::string strand(const std::string& lines) {
    return R"(def BasisCurves "C" {
    uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points = [(5, 0, 0), (5, 1, 0)]
    float[] widths = [0.5]
)" + lines +
           "}\n";
}

std::string cloud(const std::string& lines) {
    return "def Points \"D\" {\n point3f[] points = [(1, 2, 3), (2, 2, 3)]\n float[] widths = "
           "[0.25]\n" +
           lines + "}\n";
}

std::string ball(const std::string& lines) {
    return "def Sphere \"S\" {\n double radius = 0.5\n" + lines + "}\n";
}

}  // namespace

TEST(MovingShape, IsAnInstanceOfItself) {
    for (const auto& make : {&strand, &cloud, &ball}) {
        Translated t, still;
        translate_seen(half_a_frame, make(moves), t);
        EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
        EXPECT_TRUE(t.scene.shapes.empty());
        ASSERT_EQ(t.scene.instances.size(), 1u);
        const scene::Instance& instance = t.scene.instances[0];
        ASSERT_EQ(instance.later_render_from_prototype.size(), 1u);
        const Mat4 &from = instance.render_from_prototype,
                   &to = instance.later_render_from_prototype[0];
        EXPECT_EQ(Vec3(to[3][0] - from[3][0], to[3][1] - from[3][1], to[3][2] - from[3][2]),
                  Vec3(4, 0, 0));
        ASSERT_EQ(t.scene.prototypes[instance.prototype].shapes.size(), 1u);
        const scene::Shape& shape = t.scene.prototypes[instance.prototype].shapes[0];
        EXPECT_EQ(t.scene.provenance[shape.provenance].prim_path.substr(0, 1), "/");
        // With the shutter closed it is the shape alone
        translate_seen("", make(moves), still);
        ASSERT_EQ(still.scene.shapes.size(), 1u);
        EXPECT_TRUE(still.scene.instances.empty());
        EXPECT_EQ(still.scene.shapes[0].geometry.index(), shape.geometry.index());
    }
}

TEST(MovingShape, StandsAroundItself) {
    // Far from the origin of its own space: what is cast to float is near zero
    Translated t;
    translate_seen(half_a_frame, strand(moves), t);
    const auto& curves = std::get<scene::Curves>(t.scene.prototypes[0].shapes[0].geometry);
    EXPECT_EQ(curves.points[0], Vec3(0));
    EXPECT_EQ(curves.points[1], Vec3(0, 1, 0));
    EXPECT_EQ(t.scene.instances[0].render_from_prototype[3][0], 5.0f);
}

TEST(MovingShape, TurnsWithWhatIsAbove) {
    const std::string text =
        R"(def Xform "Turn" {
    float xformOp:rotateZ.timeSamples = { 1: 0, 2: 180 }
    uniform token[] xformOpOrder = ["xformOp:rotateZ"]
)" +
        ball(
            "double3 xformOp:translate = (2, 0, -9)\nfloat3 xformOp:scale = (1, 3, 1)\nuniform "
            "token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:scale\"]\n") +
        "}\n";
    Translated t;
    translate_seen(half_a_frame, text, t);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    const scene::Instance& instance = t.scene.instances[0];
    ASSERT_EQ(instance.later_render_from_prototype.size(), 16u);
    for (size_t k = 1; k <= 16; ++k) {
        const Mat4& m = instance.later_render_from_prototype[k - 1];
        const double angle = pi_d / 2 * double(k) / 16;
        EXPECT_NEAR(m[0][0], std::cos(angle), 1e-6);
        EXPECT_NEAR(m[1][0], -3 * std::sin(angle), 1e-6);
        EXPECT_NEAR(m[3][0], 2 * std::cos(angle), 1e-6);
        EXPECT_NEAR(m[3][1], 2 * std::sin(angle), 1e-6);
    }
}

TEST(MovingShape, MovesInInstancesThatMove) {
    const std::string text =
        "class Xform \"Model\" {\n" + ball(moves) + quad("Q") +
        "}\ndef \"I\" (instanceable = true; prepend references = </Model>) {\n" + moves + "}\n";
    Translated t;
    translate_seen(half_a_frame, text, t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    for (const scene::Instance& instance : t.scene.instances) {
        const auto& shapes = t.scene.prototypes[instance.prototype].shapes;
        const bool is_ball = std::holds_alternative<scene::Gprim>(shapes[0].geometry);
        ASSERT_EQ(instance.later_render_from_prototype.size(), 1u);
        EXPECT_EQ(
            instance.later_render_from_prototype[0][3][0] - instance.render_from_prototype[3][0],
            is_ball ? 8.0f : 4.0f);
    }
}

TEST(MovingShape, KeepsTheShapeOfTheFrame) {
    Translated t;
    translate_seen(half_a_frame, R"(def BasisCurves "C" {
    uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points.timeSamples = { 1: [(5, 0, 0), (5, 1, 0)], 2: [(5, 0, 0), (5, 3, 0)] }
    float[] widths = [0.5]
)" + moves + "}\n",
                   t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 1u);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    EXPECT_EQ(t.scene.instances[0].later_render_from_prototype.size(), 1u);
    const auto& curves = std::get<scene::Curves>(t.scene.prototypes[0].shapes[0].geometry);
    EXPECT_EQ(curves.points[1], Vec3(0, 1, 0));
}

TEST(MovingShape, MayGiveLight) {
    Translated t;
    translate_seen(half_a_frame, R"(def Material "Glow" {
    token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (1, 1, 1)
        token outputs:surface
    }
}
)" + ball("rel material:binding = </Glow>\n" + moves),
                   t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    EXPECT_EQ(t.scene.instances[0].later_render_from_prototype.size(), 1u);
}

}  // namespace velatura::translate::instancing
