// SPDX-License-Identifier: Apache-2.0
// motion:blurScale against shutters that are open for as much longer.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace velatura::translate::motion {

namespace {

/// The camera has its shutter open from `open` to `close`, and these lines.
void translate_seen(
    double open, double close, const std::string& lines, const std::string& text, Translated& out) {
    TranslateOptions options;
    options.time = 1.0;
    translate_text(
        camera(fmt::format("double shutter:open = {}\ndouble shutter:close = {}\n", open, close) +
               lines) +
            text,
        out, options);
    ASSERT_EQ(out.error, "") << out.error_message;
}

/// A mesh, an instance and a point instancer that move, below a prim of these lines.
std::string all_that_moves(const std::string& lines) {
    const std::string moves =
        "double3 xformOp:translate.timeSamples = { 0: (0, 0, -5), 1: (1, 0, -5), 2: (4, 0, -5) }\n"
        "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    return "class Xform \"Model\" {\n" + quad("Q") + "}\ndef Xform \"World\" {\n" + lines +
           quad("Q", moves) + "def \"I\" (instanceable = true; prepend references = </Model>) {\n" +
           moves + R"(}
def PointInstancer "P" {
    rel prototypes = </World/P/Q>
    int[] protoIndices = [0]
    point3f[] positions.timeSamples = { 0: [(0, 0, -9)], 1: [(3, 0, -9)], 2: [(4, 0, -8)] }
)" + quad("Q") +
           "}\n}\n";
}

void expect_same_motion(const scene::Scene& a, const scene::Scene& b) {
    ASSERT_EQ(a.instances.size(), b.instances.size());
    for (size_t i = 0; i < a.instances.size(); ++i) {
        EXPECT_EQ(a.instances[i].render_from_prototype, b.instances[i].render_from_prototype);
        EXPECT_EQ(a.instances[i].later_render_from_prototype,
                  b.instances[i].later_render_from_prototype);
    }
    const auto& mesh_a = std::get<scene::Mesh>(a.shapes[0].geometry);
    const auto& mesh_b = std::get<scene::Mesh>(b.shapes[0].geometry);
    EXPECT_EQ(mesh_a.points, mesh_b.points);
    EXPECT_EQ(mesh_a.later_points, mesh_b.later_points);
}

}  // namespace

TEST(BlurScale, IsAShutterThatIsOpenLonger) {
    for (const double scale : {0.5, 1.0, 2.0}) {
        Translated scaled, longer;
        translate_seen(-0.25, 0.5, "",
                       all_that_moves(fmt::format("float motion:blurScale = {}\n", scale)), scaled);
        translate_seen(-0.25 * scale, 0.5 * scale, "", all_that_moves(""), longer);
        ASSERT_EQ(scaled.scene.instances.size(), 2u);
        EXPECT_FALSE(scaled.scene.instances[0].later_render_from_prototype.empty());
        EXPECT_FALSE(scaled.mesh(0).later_points.empty());
        expect_same_motion(scaled.scene, longer.scene);
    }
}

TEST(BlurScale, OfZeroIsAClosedShutter) {
    Translated none, closed;
    translate_seen(-0.25, 0.5, "", all_that_moves("float motion:blurScale = 0\n"), none);
    translate_seen(0, 0, "", all_that_moves(""), closed);
    expect_same_motion(none.scene, closed.scene);
    EXPECT_TRUE(none.mesh(0).later_points.empty());
    EXPECT_EQ(none.count("unsupported-motion-blur"), 0u);
}

TEST(BlurScale, IsThatOfTheNearestPrim) {
    Translated nearer, plain;
    translate_seen(0, 0.5, "",
                   "def Xform \"Up\" {\n float motion:blurScale = 0\n" +
                       all_that_moves("float motion:blurScale = 1\n") + "}\n",
                   nearer);
    translate_seen(0, 0.5, "", "def Xform \"Up\" {\n" + all_that_moves("") + "}\n", plain);
    expect_same_motion(nearer.scene, plain.scene);
    Translated bad;
    translate_seen(0, 0.5, "", all_that_moves("float motion:blurScale = -2\n"), bad);
    Translated good;
    translate_seen(0, 0.5, "", all_that_moves(""), good);
    expect_same_motion(bad.scene, good.scene);
    EXPECT_GE(bad.count("bad-motion-scale"), 1u);
}

// What instances hand down to the prims of a prototype is theirs.
TEST(BlurScale, KeepsPrototypesApart) {
    const std::string text = R"(class Xform "Model" {
    def Xform "Arm" {
        double3 xformOp:translate.timeSamples = { 1: (0, 0, -5), 2: (4, 0, -5) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
)" + quad("Q") + R"(}
}
def "A" (instanceable = true; prepend references = </Model>) {}
def "B" (instanceable = true; prepend references = </Model>) { float motion:blurScale = 0.5
}
)";
    Translated t;
    translate_seen(0, 0.5, "", text, t);
    ASSERT_EQ(t.scene.prototypes.size(), 2u);
    for (const size_t i : {0u, 1u}) {
        const auto& mesh = std::get<scene::Mesh>(t.scene.prototypes[i].shapes[0].geometry);
        ASSERT_EQ(mesh.later_points.size(), 1u);
        EXPECT_EQ(mesh.later_points[0][0].x - mesh.points[0].x, i == 0 ? 2.0f : 1.0f);
    }
}

TEST(BlurScale, HoldsForTheCamera) {
    const std::string turns =
        "float xformOp:rotateY.timeSamples = { 1: 0, 2: 90 }\nuniform token[] xformOpOrder = "
        "[\"xformOp:rotateY\"]\n";
    Translated scaled, shorter, none;
    translate_seen(0, 0.5, turns + "float motion:blurScale = 0.25\n", quad("Q"), scaled);
    translate_seen(0, 0.125, turns, quad("Q"), shorter);
    translate_seen(0, 0.5, turns + "float motion:blurScale = 0\n", quad("Q"), none);
    EXPECT_FALSE(scaled.scene.camera.motion_keys.empty());
    EXPECT_EQ(scaled.scene.camera.motion_keys, shorter.scene.camera.motion_keys);
    EXPECT_TRUE(none.scene.camera.motion_keys.empty());
}

}  // namespace velatura::translate::motion
