// SPDX-License-Identifier: Apache-2.0
#include "hard_case.h"
#include "translate/support.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::translate::motion {

namespace {

TranslateOptions at_time(double time) {
    TranslateOptions options;
    options.time = time;
    return options;
}

const char* const half_a_frame = "double shutter:open = 0\ndouble shutter:close = 0.5\n";

/// A quad whose points are at p and q at frames 1 and 2, and between in the middle: `extra` holds
/// more samples.
std::string moving_quad(const std::string& extra = "", const std::string& lines = "") {
    return R"(def Mesh "Q" {
    point3f[] points.timeSamples = {
        1: [(0,0,0),(1,0,0),(1,1,0),(0,1,0)],)" +
           extra + R"(
        2: [(4,0,0),(5,0,0),(5,1,2),(4,1,0)]
    }
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0,1,2,3]
    uniform token subdivisionScheme = "none"
)" + lines +
           "}\n";
}

/// Translates behind a camera with this shutter.
void translate_at(double time,
                  const std::string& shutter,
                  const std::string& text,
                  Translated& out) {
    translate_text(camera(shutter) + text, out, at_time(time));
    ASSERT_EQ(out.error, "") << out.error_message;
}

}  // namespace

TEST(Motion, OfPointsGoesFromTheOpeningOfTheShutterToItsEnd) {
    Translated t;
    translate_at(1.25, half_a_frame, moving_quad(), t);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.later_points.size(), 1u);
    EXPECT_EQ(mesh.points[1], Vec3(2, 0, 0));
    EXPECT_EQ(mesh.later_points[0][1], Vec3(4, 0, 0));
    EXPECT_EQ(mesh.points[2].z, 0.5f);
    EXPECT_EQ(mesh.later_points[0][2].z, 1.5f);
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
}

TEST(Motion, IsNoneWhereTheShutterIsClosed) {
    for (const char* shutter : {"", "double shutter:open = 0.25\ndouble shutter:close = 0.25\n"}) {
        Translated t;
        translate_at(1.5, shutter, moving_quad(), t);
        EXPECT_TRUE(t.mesh(0).later_points.empty());
        EXPECT_EQ(t.mesh(0).points[1], Vec3(3, 0, 0));
    }
    // Settings may keep it from opening
    Translated t;
    translate_text("#usda 1.0\n(\n renderSettingsPrimPath = \"/S\"\n)\n" + camera(half_a_frame) +
                       moving_quad() +
                       "def RenderSettings \"S\" { rel camera = </Cam>\n uniform bool "
                       "disableMotionBlur = 1\n }\n",
                   t, at_time(1.5));
    ASSERT_EQ(t.error, "");
    EXPECT_TRUE(t.mesh(0).later_points.empty());
    // Without a time nothing moves
    Translated still;
    translate_text(camera(half_a_frame) + moving_quad("", "") + quad("R"), still);
    for (const scene::Shape& shape : still.scene.shapes)
        EXPECT_TRUE(std::get<scene::Mesh>(shape.geometry).later_points.empty());
    Translated backward;
    translate_at(1.5, "double shutter:open = 0.5\ndouble shutter:close = 0\n", moving_quad(),
                 backward);
    EXPECT_TRUE(backward.mesh(0).later_points.empty());
    EXPECT_EQ(backward.count("bad-camera-value"), 1u);
}

// Exporters leave out renderSettingsPrimPath: settings that all want an instantaneous shutter mean
// their cameras' shutters not to count (luxtest)
TEST(Motion, IsNoneWhereAllSettingsOfTheStageWantNone) {
    const std::string still =
        "def RenderSettings \"S\" { uniform bool instantaneousShutter = 1\n}\n";
    for (const auto& [settings, moves] :
         {std::pair<std::string, bool>{still, false},
          {still + "def RenderSettings \"T\" { uniform bool disableMotionBlur = 1\n}\n", false},
          {still + "def RenderSettings \"T\" {}\n", true},
          {"def RenderSettings \"T\" {}\n", true}}) {
        Translated t;
        translate_text(camera(half_a_frame) + moving_quad() + settings, t, at_time(1.5));
        ASSERT_EQ(t.error, "");
        EXPECT_EQ(!t.mesh(0).later_points.empty(), moves) << settings;
    }
}

TEST(Motion, HasAKeyAtEverySample) {
    // A sample at a third of the shutter's time
    Translated t;
    translate_at(1, "double shutter:close = 0.75\n",
                 moving_quad("1.25: [(9,0,0),(1,0,0),(1,1,0),(0,1,0)],"), t);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.later_points.size(), 3u);
    EXPECT_EQ(mesh.points[0].x, 0);
    EXPECT_EQ(mesh.later_points[0][0].x, 9);
    EXPECT_NEAR(mesh.later_points[1][0].x, 9 - 5.0 / 3, 1e-6);
    EXPECT_NEAR(mesh.later_points[2][0].x, 9 - 10.0 / 3, 1e-6);
}

TEST(Motion, OfTransformsIsOneOfPoints) {
    // A turn of 90 degrees in half a frame about a pivot above, which also drifts
    const std::string text = R"(def Xform "Up" {
    double3 xformOp:translate.timeSamples = { 1: (0, 0, -4), 2: (0, 2, -4) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "Turn" {
        float xformOp:rotateZ.timeSamples = { 1: 0, 2: 180 }
        uniform token[] xformOpOrder = ["xformOp:rotateZ"]
)" + quad("Q") + "}\n}\n";
    Translated t;
    translate_at(1, half_a_frame, text, t);
    const scene::Mesh& mesh = t.mesh(0);
    const size_t segments = mesh.later_points.size();
    EXPECT_EQ(segments, 16u);
    for (size_t k = 1; k <= segments; ++k) {
        const double way = double(k) / double(segments), angle = way * pi_d / 2;
        const Vec3d expected(std::cos(angle), std::sin(angle) + way, -4);
        EXPECT_NEAR((Vec3d(mesh.later_points[k - 1][1]) - expected).length(), 0, 1e-6);
    }
    // Three degrees are nearly straight
    Translated slow;
    translate_at(1, "double shutter:close = 0.01666\n", text, slow);
    EXPECT_EQ(slow.mesh(0).later_points.size(), 1u);
    EXPECT_EQ(slow.count("unsupported-motion-blur"), 0u);
}

// Whole turns bring everything back to where it was, at the keys and halfway.
TEST(H47Motion, OfWholeTurnsIsNoRest) {
    double fewest = 1e9;
    for (const int turns : {1, 2, 3, 4, 6, 7, 12}) {
        const std::string spin =
            "float xformOp:rotateZ.timeSamples = { 1: 0, 2: " + std::to_string(360 * turns) +
            " }\nuniform token[] xformOpOrder = [\"xformOp:rotateZ\"]\n";
        Translated t;
        translate_at(1, "double shutter:close = 1\n",
                     "class Xform \"Model\" {\n" + quad("Q") +
                         "}\ndef \"A\" (instanceable = true; prepend references = </Model>) {\n" +
                         spin + "}\ndef Xform \"X\" {\n" + spin + quad("Q") + "}\n",
                     t);
        ASSERT_EQ(t.scene.instances.size(), 1u);
        EXPECT_EQ(t.mesh(0).later_points.size(), 16u) << turns;
        EXPECT_EQ(t.scene.instances[0].later_render_from_prototype.size(), 16u) << turns;
        fewest = std::min(fewest, double(t.scene.instances[0].later_render_from_prototype.size()));
    }
    hardcase::expect_within(
        {"segments that turns by 360 degrees lack of 16", 16 - fewest, 0, 0, "keys"});
}

TEST(Motion, TurnsNormalsAsWell) {
    const std::string authored =
        "normal3f[] normals.timeSamples = { 1: [(0,0,1),(0,0,1),(0,0,1),(0,0,1)],"
        " 2: [(1,0,0),(0,0,1),(0,0,1),(0,0,1)] }\n";
    Translated t;
    translate_at(1, half_a_frame, moving_quad("", authored), t);
    ASSERT_EQ(t.mesh(0).later_normals.size(), t.mesh(0).later_points.size());
    EXPECT_EQ(t.mesh(0).normals[0], Vec3(0, 0, 1));
    const Vec3& n = t.mesh(0).later_normals.back()[0];
    EXPECT_NEAR(n.x, std::sqrt(0.5), 1e-6);
    // Those of a smooth surface follow the points
    Translated smooth;
    std::string text = moving_quad();
    text.replace(text.find("\"none\""), 6, "\"catmullClark\"");
    translate_at(1, half_a_frame, text, smooth);
    const scene::Mesh& mesh = smooth.mesh(0);
    ASSERT_EQ(mesh.later_normals.size(), mesh.later_points.size());
    EXPECT_EQ(mesh.normals[2], Vec3(0, 0, 1));
    EXPECT_LT(mesh.later_normals.back()[2].z, 0.9f);
}

TEST(Motion, LeavesOutTheNormalsOfFacesThatAreLeftOut) {
    const std::string text = R"(def Mesh "M" {
    point3f[] points.timeSamples = { 1: [(0,0,0),(1,0,0),(1,1,0),(0,1,0)],
        2: [(0,0,1),(1,0,1),(1,1,1),(0,1,1)] }
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0,1,2, 0,2,3]
    int[] holeIndices = [0]
    uniform token subdivisionScheme = "none"
    normal3f[] normals (interpolation = "faceVarying")
    normal3f[] normals.timeSamples = {
        1: [(1,0,0),(1,0,0),(1,0,0),(0,0,1),(0,0,1),(0,0,1)],
        2: [(1,0,0),(1,0,0),(1,0,0),(0,1,0),(0,1,0),(0,1,0)] }
})";
    Translated t;
    translate_at(1, "double shutter:close = 1\n", text, t);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.later_normals.size(), 1u);
    EXPECT_EQ(mesh.normals, std::vector<Vec3>(3, Vec3(0, 0, 1)));
    EXPECT_EQ(mesh.later_normals[0], std::vector<Vec3>(3, Vec3(0, 1, 0)));
}

TEST(Motion, OfSkinnedPointsIsThatOfTheirJoints) {
    const std::string text = R"(def SkelRoot "Root" (prepend apiSchemas = ["SkelBindingAPI"]) {
    rel skel:skeleton = </Root/Skel>
    def Skeleton "Skel" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["A"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        rel skel:animationSource = </Root/Skel/Anim>
        def SkelAnimation "Anim" {
            uniform token[] joints = ["A"]
            float3[] translations.timeSamples = { 1: [(0,0,0)], 2: [(0,8,0)] }
            quatf[] rotations = [(1, 0, 0, 0)]
            half3[] scales = [(1, 1, 1)]
        }
    }
    def Mesh "Mesh" (prepend apiSchemas = ["SkelBindingAPI"]) {
        point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0,1,2,3]
        uniform token subdivisionScheme = "none"
        int[] primvars:skel:jointIndices = [0,0,0,0] (interpolation = "vertex"; elementSize = 1)
        float[] primvars:skel:jointWeights = [1,1,1,1] (interpolation = "vertex"; elementSize = 1)
    }
})";
    Translated t;
    translate_at(1.25, half_a_frame, text, t);
    const scene::Mesh& mesh = t.mesh(0);
    ASSERT_EQ(mesh.later_points.size(), 1u);
    EXPECT_EQ(mesh.points[1], Vec3(1, 2, 0));
    EXPECT_EQ(mesh.later_points[0][1], Vec3(1, 6, 0));
}

TEST(Motion, OfAPrototypeIsInItsOwnSpace) {
    const std::string instances = "class Xform \"Model\" {\n" + moving_quad() + "}\n" +
                                  R"(def "A" (instanceable = true; prepend references = </Model>) {}
def Xform "B" (instanceable = true; prepend references = </Model>) {
    double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";
    Translated t;
    translate_at(1, half_a_frame, instances, t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    ASSERT_EQ(t.scene.prototypes.size(), 1u);
    const auto& mesh = std::get<scene::Mesh>(t.scene.prototypes[0].shapes[0].geometry);
    ASSERT_EQ(mesh.later_points.size(), 1u);
    EXPECT_EQ(mesh.later_points[0][0].x - mesh.points[0].x, 2);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
}

TEST(Motion, OfInstancesIsOneOfMatrices) {
    // A wheel on a cart: the one turns, the other drives
    const std::string text = "class Xform \"Wheel\" {\n" + quad("Q") + R"(}
class Xform "Cart" {
)" + quad("Bed") + R"(
    def "W" (instanceable = true; prepend references = </Wheel>) {
        float xformOp:rotateZ.timeSamples = { 1: 0, 2: 180 }
        uniform token[] xformOpOrder = ["xformOp:rotateZ"]
    }
}
def Xform "Road" {
    double3 xformOp:translate.timeSamples = { 1: (0, 0, -5), 2: (8, 0, -5) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def "C" (instanceable = true; prepend references = </Cart>) {}
}
def "Still" (instanceable = true; prepend references = </Cart>) {}
)";
    Translated t;
    translate_at(1, half_a_frame, text, t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
    // Carts and their wheels
    ASSERT_EQ(t.scene.instances.size(), 4u);
    size_t driving = 0, turning = 0, still = 0;
    for (const scene::Instance& instance : t.scene.instances) {
        const std::vector<Mat4>& later = instance.later_render_from_prototype;
        const bool is_wheel =
            t.scene.prototypes[instance.prototype].shapes.size() == 1 && later.size() == 16;
        const Mat4& first = instance.render_from_prototype;
        const bool drives = first[3][2] == -5;
        driving += drives;
        turning += is_wheel;
        still += later.empty();
        for (size_t k = 1; k <= later.size(); ++k) {
            const double way = double(k) / double(later.size());
            if (is_wheel) {
                EXPECT_NEAR(later[k - 1][0][0], std::cos(way * pi_d / 2), 1e-6);
                EXPECT_NEAR(later[k - 1][0][1], std::sin(way * pi_d / 2), 1e-6);
            }
            EXPECT_NEAR(later[k - 1][3][0] - first[3][0], drives ? 4 * way : 0.0, 1e-5);
        }
    }
    EXPECT_EQ(driving, 2u);
    EXPECT_EQ(turning, 2u);
    EXPECT_EQ(still, 1u);  // the cart that stays; its wheel turns
    // The driving cart goes straight
    for (const scene::Instance& instance : t.scene.instances) {
        if (instance.render_from_prototype[3][2] == -5 &&
            instance.later_render_from_prototype.size() != 16) {
            EXPECT_EQ(instance.later_render_from_prototype.size(), 1u);
        }
    }
}

// To and fro, and back at rest wherever straight lines are asked for.
TEST(Motion, OfInstancesBetweenSamplesIsSeen) {
    Translated t;
    translate_at(
        0, "double shutter:close = 1\n",
        "class Xform \"Model\" {\n" + quad("Q") +
            "}\ndef \"A\" (instanceable = true; prepend references = </Model>) {\n"
            "double3 xformOp:translate.timeSamples = { 0: (0, 0, -9), 0.2: (5, 0, -9), 0.35: "
            "(0, 0, -9), 1: (0, 0, -9) }\nuniform token[] xformOpOrder = "
            "[\"xformOp:translate\"]\n}\n",
        t);
    ASSERT_EQ(t.scene.instances.size(), 1u);
    const auto& later = t.scene.instances[0].later_render_from_prototype;
    ASSERT_EQ(later.size(), 16u);
    for (size_t k = 1; k <= 16; ++k) {
        const double way = double(k) / 16;
        const double x = way < 0.2 ? 25 * way : std::max(0.0, 5 - 5 * (way - 0.2) / 0.15);
        EXPECT_NEAR(later[k - 1][3][0], x, 1e-5) << k;
    }
}

// Two motions that are straight each are not when one carries the other.
TEST(Motion, OfInstancesInInstancesIsStraightFromKeyToKey) {
    const std::string text = "class Xform \"Inner\" {\n" + quad("Q") + R"(}
class Xform "Outer" {
)" + quad("Q") + R"(
    def "I" (instanceable = true; prepend references = </Inner>) {
        double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (10, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def "O" (instanceable = true; prepend references = </Outer>) {
    float3 xformOp:scale.timeSamples = { 1: (1, 1, 1), 2: (3, 3, 3) }
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
)";
    Translated t;
    translate_at(1, "double shutter:close = 1\n", text, t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    for (const scene::Instance& instance : t.scene.instances) {
        const auto& later = instance.later_render_from_prototype;
        const bool is_inner = later.back()[3][0] > 20;
        EXPECT_EQ(later.size(), is_inner ? 16u : 1u);
        for (size_t k = 1; k <= later.size(); ++k) {
            const double way = double(k) / double(later.size()), scale = 1 + 2 * way;
            EXPECT_NEAR(later[k - 1][0][0], scale, 1e-5);
            // Around the quad's origin
            const float moved = later[k - 1][3][0] - instance.render_from_prototype[3][0];
            EXPECT_NEAR(moved, is_inner ? 10 * way * scale : 0.0, 1e-4);
        }
    }
}

TEST(Motion, OfInstancesOutOfReachOfFloatsIsNamed) {
    for (const char* end : {"(1e60, 0, 0)", "(inf, 0, 0)", "(nan, 0, 0)"}) {
        Translated t;
        translate_at(1, "double shutter:close = 1\n",
                     "class Xform \"Model\" {\n" + quad("Q") +
                         "}\ndef \"A\" (instanceable = true; prepend references = </Model>) {\n"
                         "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: " +
                         end + " }\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n",
                     t);
        EXPECT_EQ(t.count("unsupported-motion-blur"), 1u) << end;
        ASSERT_EQ(t.scene.instances.size(), 1u) << end;
        EXPECT_TRUE(t.scene.instances[0].later_render_from_prototype.empty()) << end;
    }
}

TEST(Motion, LeavesWhatStaysAsItIs) {
    const std::string text =
        "def Xform \"X\" {\n double3 xformOp:translate.timeSamples = { 1: (1.1, 2.3, -3.7), 2: "
        "(1.1, 2.3, -3.7) }\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" +
        quad("Q") + "}\n" + quad("R");
    Translated open, closed;
    translate_at(1, half_a_frame, text, open);
    translate_at(1, "", text, closed);
    for (const size_t i : {0u, 1u}) {
        EXPECT_EQ(open.mesh(i).points, closed.mesh(i).points);
        EXPECT_TRUE(open.mesh(i).later_points.empty());
    }
}

TEST(Motion, OfACameraFollowsItsCurve) {
    // Half a turn about Y at a distance of 3 from the axis, and a joint that is there at one
    // instant only
    const std::string turn =
        "double3 xformOp:translate = (0, 0, 3)\nfloat xformOp:rotateY.timeSamples = { 1: 0, 2: 360 "
        "}\nuniform token[] xformOpOrder = [\"xformOp:rotateY\", \"xformOp:translate\"]\n";
    Translated t;
    translate_at(1, half_a_frame + turn, quad("Q"), t);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 0u);
    const std::vector<Mat4d>& keys = t.scene.camera.motion_keys;
    ASSERT_GE(keys.size(), 33u);
    const size_t segments = keys.size() - 1;
    double worst = 0;
    for (size_t k = 0; k < segments; ++k) {
        for (const double f : {0.0, 0.3, 0.5}) {
            const Mat4d m = keys[k] * (1 - f) + keys[k + 1] * f;
            const double angle = pi_d * (double(k) + f) / double(segments);
            // Row vectors: the axes are rows
            const Vec3d right = Vec3d(m[0][0], m[0][1], m[0][2]).normalized();
            worst = hardcase::larger(
                worst, right.cross(Vec3d(std::cos(angle), 0, -std::sin(angle))).length());
            const Vec3d place(3 * std::sin(angle), 0, 3 * std::cos(angle) - 3);
            EXPECT_NEAR((Vec3d(m[3][0], m[3][1], m[3][2]) - place).length(), 0, 2e-3);
        }
    }
    EXPECT_LT(worst, 2e-5);
    Translated closed;
    translate_at(1, turn, quad("Q"), closed);
    EXPECT_TRUE(closed.scene.camera.motion_keys.empty());
    Translated still;
    translate_at(1, half_a_frame, quad("Q"), still);
    EXPECT_TRUE(still.scene.camera.motion_keys.empty());
}

TEST(Motion, OfLightsAndVolumesIsFollowed) {
    const std::string moves =
        "double3 xformOp:translate.timeSamples = { 1: (0,0,0), 2: (4,0,0) }\nuniform token[] "
        "xformOpOrder = [\"xformOp:translate\"]\n";
    const std::string carried = "def Xform \"Cart\" {\n" + moves;
    const auto of_light = [&](const std::string& text, size_t index = 0) {
        Translated t;
        translate_at(1, half_a_frame, text, t);
        EXPECT_EQ(t.count("unsupported-motion-blur"), 0u) << text;
        EXPECT_GT(t.scene.lights.size(), index) << text;
        return index < t.scene.lights.size() ? t.scene.lights[index] : scene::Light();
    };
    // By its own transform, by those above it, by an instance, and in an instance
    const std::string model = "class Xform \"Model\" {\ndef SphereLight \"L\" {}\n}\n";
    const std::string moving_model =
        "class Xform \"Model\" {\ndef SphereLight \"L\" {\n" + moves + "}\n}\n";
    const std::string instance =
        "def \"A\" (instanceable = true; prepend references = </Model>) {\n";
    for (const std::string& text :
         {"def RectLight \"L\" {\n" + moves + "}\n", carried + "def DiskLight \"L\" {}\n}\n",
          model + instance + moves + "}\n", moving_model + instance + "}\n"}) {
        const scene::Light light = of_light(text);
        ASSERT_EQ(light.later_render_from_light.size(), 1u) << text;
        EXPECT_EQ(light.render_from_light[3][0], 0) << text;
        EXPECT_EQ(light.later_render_from_light[0][3][0], 2) << text;
    }
    // One that moves in what moves
    const scene::Light both = of_light(moving_model + instance + moves + "}\n");
    ASSERT_EQ(both.later_render_from_light.size(), 1u);
    EXPECT_EQ(both.later_render_from_light[0][3][0], 4);
    // Turns need keys; of what is at infinity nothing else counts
    const std::string turns =
        "float xformOp:rotateY.timeSamples = { 1: 0, 2: 90 }\nuniform token[] xformOpOrder = "
        "[\"xformOp:rotateY\"]\n";
    EXPECT_TRUE(
        of_light("def DistantLight \"L\" {\n" + moves + "}\n").later_render_from_light.empty());
    const scene::Light sun = of_light("def DistantLight \"L\" {\n" + turns + "}\n");
    const size_t segments = sun.later_render_from_light.size();
    EXPECT_EQ(segments, 16u);
    for (size_t k = 1; k <= segments; ++k) {
        const double angle = double(k) / double(segments) * pi_d / 4;
        const Mat4d& m = sun.later_render_from_light[k - 1];
        EXPECT_NEAR((Vec3d(m[2][0], m[2][1], m[2][2]) - Vec3d(std::sin(angle), 0, std::cos(angle)))
                        .length(),
                    0, 1e-12);
    }
    EXPECT_EQ(of_light("def DomeLight \"L\" {\n" + turns + "}\n").later_render_from_light.size(),
              16u);
    EXPECT_TRUE(of_light("def SphereLight \"L\" {}\n").later_render_from_light.empty());
    // The same of a dome that an instance moves
    const std::string dome = "class Xform \"Model\" {\ndef DomeLight \"L\" {}\n}\n";
    EXPECT_TRUE(of_light(dome + instance + moves + "}\n").later_render_from_light.empty());
    EXPECT_EQ(of_light(dome + instance + turns + "}\n").later_render_from_light.size(), 16u);
    // A point has no size, but a distance: an arc of 0.1 degrees is as good as straight
    const auto turning_point = [&](const char* degrees) {
        return of_light(std::string("def Xform \"Arm\" {\nfloat xformOp:rotateY.timeSamples = { "
                                    "1: 0, 2: ") +
                        degrees +
                        " }\nuniform token[] xformOpOrder = [\"xformOp:rotateY\"]\ndef SphereLight "
                        "\"L\" {\nfloat inputs:radius = 0\nbool inputs:normalize = 1\ndouble3 "
                        "xformOp:translate = (0, 0, 10)\nuniform token[] xformOpOrder = "
                        "[\"xformOp:translate\"]\n}\n}\n")
            .later_render_from_light.size();
    };
    EXPECT_EQ(turning_point("0.2"), 1u);
    EXPECT_EQ(turning_point("90"), 16u);

    // Geometry that is light, as other geometry
    Translated ball, mesh;
    translate_at(1, half_a_frame,
                 "def Sphere \"S\" (prepend apiSchemas = [\"LightAPI\"]) {\n" + moves + "}\n",
                 ball);
    ASSERT_EQ(ball.scene.instances.size(), 1u);
    EXPECT_EQ(ball.scene.instances[0].later_render_from_prototype.size(), 1u);
    ASSERT_EQ(ball.scene.mesh_lights.size(), 1u);
    EXPECT_EQ(ball.scene.prototypes[0].shapes[0].light, 0u);
    EXPECT_NE(ball.scene.mesh_lights[0].group, scene::none);
    translate_at(1, half_a_frame,
                 "def Mesh \"M\" (prepend apiSchemas = [\"MeshLightAPI\"]) {\n" + moves +
                     quad("Q").substr(std::string("def Mesh \"Q\" {").size()),
                 mesh);
    EXPECT_EQ(mesh.mesh(0).later_points.size(), 1u);
    ASSERT_EQ(mesh.scene.mesh_lights.size(), 1u);
    ASSERT_EQ(mesh.scene.mesh_lights[0].later_parent_from_light.size(), 1u);
    EXPECT_EQ(mesh.scene.mesh_lights[0].later_parent_from_light[0][3][0] -
                  mesh.scene.mesh_lights[0].parent_from_light[3][0],
              2);
    EXPECT_EQ(ball.count("unsupported-motion-blur") + mesh.count("unsupported-motion-blur"), 0u);

    Translated smoke;
    translate_at(1, half_a_frame,
                 "def Volume \"V\" {\n" + moves +
                     "rel field:density = </V/D>\ndef OpenVDBAsset \"D\" { asset filePath = "
                     "@smoke.vdb@\ntoken fieldName = \"density\"\n}\n}\n",
                 smoke);
    ASSERT_EQ(smoke.scene.volumes.size(), 1u);
    ASSERT_EQ(smoke.scene.volumes[0].later_render_from_volume.size(), 1u);
    EXPECT_EQ(smoke.scene.volumes[0].later_render_from_volume[0][3][0] -
                  smoke.scene.volumes[0].render_from_volume[3][0],
              2);
    EXPECT_EQ(smoke.count("unsupported-motion-blur"), 0u);
}

TEST(Motion, ThatIsNotRenderedIsNamed) {
    const std::string moves =
        "double3 xformOp:translate.timeSamples = { 1: (0,0,0), 2: (1,0,0) }\nuniform token[] "
        "xformOpOrder = [\"xformOp:translate\"]\n";

    const struct {
        const char* what;
        std::string shutter, text;
        size_t warnings;
    } cases[] = {
        {"a ball that grows", half_a_frame,
         "def Sphere \"S\" {\n double radius.timeSamples = { 1: 1, 2: 2 }\n}\n", 1},
        {"a light that is flat in between", half_a_frame,
         "def RectLight \"L\" {\nfloat3 xformOp:scale.timeSamples = { 1: (1,1,1), 1.25: (0,0,1), "
         "1.5: (1,1,1) }\nuniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n",
         1},
        {"a topology that changes", half_a_frame,
         moving_quad("1.4: [(0,0,0),(1,0,0),(1,1,0),(0,1,0),(0,2,0)],"), 1},
        {"a topology that is another one in between", half_a_frame,
         "def Mesh \"M\" {\n" + moves +
             "point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]\nint[] faceVertexCounts = [3]\n"
             "int[] faceVertexIndices.timeSamples = { 1: [0,1,2], 1.2: [1,2,3], 1.4: [0,1,2] "
             "}\n}\n",
         1},
        {"a point that is nowhere", half_a_frame,
         moving_quad("1.4: [(0,0,0),(1,0,0),(nan,1,0),(0,1,0)],"), 1},
        {"nothing with a closed shutter", moves, "def Sphere \"S\" {\n" + moves + "}\n", 0},
        {"nothing that stays", half_a_frame, "def Sphere \"S\" {}\n" + quad("Q"), 0},
    };

    for (const auto& c : cases) {
        Translated t;
        translate_at(1, c.shutter, c.text, t);
        EXPECT_EQ(t.count("unsupported-motion-blur"), c.warnings) << c.what;
        for (const scene::Shape& shape : t.scene.shapes) {
            const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
            EXPECT_TRUE(!mesh || mesh->later_points.empty()) << c.what;
        }
    }
}

}  // namespace velatura::translate::motion
