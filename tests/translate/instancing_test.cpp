// SPDX-License-Identifier: Apache-2.0
#include "support.h"

#include <gtest/gtest.h>

namespace velatura::translate {

namespace {

Vec3 position(const scene::Instance& i) {
    return {i.render_from_prototype[3][0], i.render_from_prototype[3][1],
            i.render_from_prototype[3][2]};
}

std::string lamp_instances(const std::string& second = "") {
    return camera() + R"(
class Xform "Lamp" {
    def Xform "Body" {
        double3 xformOp:translate = (0, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
)" + quad("Q") +
           R"(
    }
    def SphereLight "Bulb" {
        double3 xformOp:translate = (0, 3, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "A" (instanceable = true
    inherits = </Lamp>) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "B" (instanceable = true
    inherits = </Lamp>) {
    double3 xformOp:translate = (20, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)" + second +
           "}\n";
}

}  // namespace

TEST(NativeInstancing, SharesOnePrototypeAndPlacesItsLights) {
    Translated t;
    translate_text(lamp_instances(), t);
    ASSERT_EQ(t.scene.prototypes.size(), 1u);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_TRUE(t.scene.shapes.empty());
    EXPECT_EQ(position(t.scene.instances[0]), Vec3(10, 0, 0));
    EXPECT_EQ(position(t.scene.instances[1]), Vec3(20, 0, 0));
    ASSERT_EQ(t.scene.prototypes[0].shapes.size(), 1u);
    EXPECT_EQ(std::get<scene::Mesh>(t.scene.prototypes[0].shapes[0].geometry).points[0],
              Vec3(0, 1, 0));
    ASSERT_EQ(t.scene.lights.size(), 2u);
    EXPECT_EQ(t.scene.lights[0].render_from_light[3][0], 10.0);
    EXPECT_EQ(t.scene.lights[1].render_from_light[3][0], 20.0);
    EXPECT_EQ(t.scene.lights[1].render_from_light[3][1], 3.0);
    EXPECT_EQ(t.scene.lights[0].group, t.scene.lights[1].group);
}

TEST(NativeInstancing, DifferentInheritedColourNeedsItsOwnPrototype) {
    Translated t;
    translate_text(
        lamp_instances(
            "color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = \"constant\")\n"),
        t);
    EXPECT_EQ(t.scene.instances.size(), 2u);
    ASSERT_EQ(t.scene.prototypes.size(), 2u);
    EXPECT_EQ(std::get<scene::Mesh>(t.scene.prototypes[1].shapes[0].geometry).primvars.size(), 1u);
}

TEST(NativeInstancing, NestedOnesResolveToLeaves) {
    const std::string text = camera() + "class Xform \"Leaf\" {\n" + quad("Q") + R"(}
class Xform "Branch" {
    def Xform "L1" (instanceable = true
        inherits = </Leaf>) {
        double3 xformOp:translate = (1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "L2" (instanceable = true
        inherits = </Leaf>) {
        double3 xformOp:translate = (2, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "T1" (instanceable = true
    inherits = </Branch>) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "T2" (instanceable = true
    inherits = </Branch>) {
    double3 xformOp:translate = (20, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";
    Translated t;
    translate_text(text, t);
    ASSERT_EQ(t.scene.instances.size(), 4u);
    EXPECT_EQ(t.scene.prototypes.size(), 1u);
    EXPECT_EQ(position(t.scene.instances[3]), Vec3(22, 0, 0));
    TranslateOptions options;
    options.max_instances = 3;
    Translated capped;
    translate_text(text, capped, options);
    EXPECT_EQ(capped.scene.instances.size(), 3u);
    EXPECT_EQ(capped.count("too-many-instances"), 1u);
}

TEST(PointInstancer, PlacesScalesRotatesHidesAndColours) {
    Translated t;
    translate_text(camera() + R"(
def PointInstancer "P" (inactiveIds = [13]) {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</P/Protos/Cube>, </P/Protos/Ball>]
    int[] protoIndices = [0, 1, 0, 1, 7]
    int64[] ids = [10, 11, 12, 13, 14]
    int64[] invisibleIds = [11]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0), (5, 0, 0)]
    float3[] scales = [(2, 2, 2), (1, 1, 1), (1, 3, 1), (1, 1, 1), (1, 1, 1)]
    quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678),
        (1, 0, 0, 0), (1, 0, 0, 0)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1),
        (0, 0, 0)] (interpolation = "vertex")
    over "Protos" {
        def Cube "Cube" {
            double3 xformOp:translate = (0, 1, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Sphere "Ball" {}
    }
}
)",
                   t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_TRUE(t.scene.shapes.empty());
    EXPECT_EQ(position(t.scene.instances[0]), Vec3(101, 0, 0));
    EXPECT_EQ(t.scene.instances[0].render_from_prototype[1][1], 2.0f);
    EXPECT_EQ(*t.scene.instances[1].display_color, Rgb(0, 0, 1));
    // Scale (1, 3, 1), then a quarter turn about z: the prototype's y goes to −3x. The prototype's
    // own move is in its shape
    const Mat4& m = t.scene.instances[1].render_from_prototype;
    EXPECT_NEAR(m[1][0], -3.0f, 1e-3f);
    EXPECT_NEAR(m[1][1], 0.0f, 1e-3f);
    const auto& gprim = std::get<scene::Gprim>(t.scene.prototypes[0].shapes[0].geometry);
    EXPECT_EQ(gprim.shape_from_gprim[3][1], 1.0);
    EXPECT_EQ(t.count("bad-instancer"), 1u);
}

TEST(PointInstancer, FlatInstancesAreBaked) {
    Translated t;
    translate_text(camera() + R"(
def PointInstancer "P" {
    rel prototypes = </P/Q>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
    float3[] scales = [(1, 1, 0), (1, 1, 1), (0, 0, 0)]
)" + quad("Q") + "}\n",
                   t);
    EXPECT_EQ(t.scene.instances.size(), 1u);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    EXPECT_EQ(t.mesh(0).points[2], Vec3(2, 1, 0));
    EXPECT_EQ(t.count("bad-transform"), 1u);
}

}  // namespace velatura::translate
