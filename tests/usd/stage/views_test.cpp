// SPDX-License-Identifier: Apache-2.0
#include "stage_fixture.h"
#include "usd/stage/collection.h"
#include "usd/stage/imageable.h"
#include "usd/stage/material_binding.h"
#include "usd/stage/primvars.h"
#include "usd/stage/xform.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace velatura::usd::stage {
namespace {

using ViewsTest = StageTest;

void expect_point(const Mat4d& m, const Vec3d& from, const Vec3d& to) {
    const Vec3d got = transform_point(from, m);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(got[i], to[i], 1e-12) << "component " << i;
}

TEST_F(ViewsTest, LastOpMeetsThePointFirst) {
    open(R"(
def Xform "P" {
    double3 xformOp:translate = (10, 0, 0)
    float xformOp:rotateZ = 90
    float3 xformOp:scale = (2, 3, 4)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]
}
)");
    // (1, 1, 0) → scaled (2, 3, 0) → turned (-3, 2, 0) → moved (7, 2, 0)
    expect_point(local_transform(stage().prim_at("/P")).matrix, {1, 1, 0}, {7, 2, 0});
}

TEST_F(ViewsTest, EveryRotationOrderIsItsSingleRotations) {
    const std::array<const char*, 6> orders = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};
    std::string body;
    for (const char* order : orders) {
        const std::string o = order;
        body += "def Xform \"" + o + "\" { float3 xformOp:rotate" + o + " = (20, 50, -70)\n" +
                "uniform token[] xformOpOrder = [\"xformOp:rotate" + o + "\"] }\n";
        // The first letter is innermost, so it is listed last
        body +=
            "def Xform \"S" + o +
            "\" { double xformOp:rotateX = 20; half xformOp:rotateY = 50; float xformOp:rotateZ "
            "= -70\n"
            "uniform token[] xformOpOrder = [";
        for (size_t i = 3; i-- > 0;)
            body += std::string("\"xformOp:rotate") + o[i] + "\"" + (i ? ", " : "] }\n");
    }
    open(body);
    for (const char* order : orders) {
        const Mat4d a = local_transform(stage().prim_at(std::string("/") + order)).matrix;
        const Mat4d b = local_transform(stage().prim_at(std::string("/S") + order)).matrix;
        EXPECT_TRUE(a.equalWithAbsError(b, 1e-14)) << order;
    }
}

TEST_F(ViewsTest, OrientInvertResetAndSingleAxisOps) {
    open(R"(
def Xform "Up" {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "Reset" {
        quatf xformOp:orient = (0.70710678, 0, 0, 0.70710678)
        double xformOp:translateX = 5
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translateX", "xformOp:orient"]
    }
    def Xform "Pivot" {
        double3 xformOp:translate:pivot = (1, 2, 3)
        float xformOp:rotateZ = 180
        uniform token[] xformOpOrder = ["xformOp:translate:pivot", "xformOp:rotateZ",
            "!invert!xformOp:translate:pivot"]
    }
    def Xform "Missing" { uniform token[] xformOpOrder = ["xformOp:scale"] }
}
)");
    const Mat4d reset = world_transform(stage().prim_at("/Up/Reset"));
    const Vec3d p = transform_point(Vec3d(1, 0, 0), reset);
    EXPECT_NEAR(p.x, 5.0, 1e-7);
    EXPECT_NEAR(p.y, 1.0, 1e-7);
    EXPECT_TRUE(local_transform(stage().prim_at("/Up/Reset")).resets_stack);
    expect_point(world_transform(stage().prim_at("/Up/Pivot")), {1, 2, 3}, {101, 2, 3});
    expect_point(world_transform(stage().prim_at("/Up/Pivot")), {2, 2, 3}, {100, 2, 3});
    EXPECT_EQ(local_transform(stage().prim_at("/Up/Missing")).matrix, Mat4d());
}

TEST_F(ViewsTest, AnimatedTransformsHaveTimes) {
    open(R"(
def Xform "P" {
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 3: (2, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)");
    const Prim prim = stage().prim_at("/P");
    EXPECT_TRUE(local_transform(prim, 2.0).might_be_varying);
    expect_point(local_transform(prim, 2.0).matrix, {0, 0, 0}, {1, 0, 0});
    EXPECT_EQ(transform_sample_times(prim), (std::vector<double>{1.0, 3.0}));
}

TEST_F(ViewsTest, AnOpWithoutAValueAtATimeIsNoError) {
    open(R"(
def Xform "P" {
    double3 xformOp:translate.timeSamples = { 1: (1, 2, 3) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)");
    EXPECT_EQ(local_transform(stage().prim_at("/P")).matrix, Mat4d());
    expect_point(local_transform(stage().prim_at("/P"), 1.0).matrix, {0, 0, 0}, {1, 2, 3});
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(ViewsTest, VisibilityPrunesAndPurposeComesFromTheNearest) {
    open(R"(
def Xform "A" { token visibility = "invisible"; uniform token purpose = "proxy"
    def Xform "B" { token visibility = "inherited"
        def Xform "C" { uniform token purpose = "render" } } }
)");
    EXPECT_FALSE(is_visible_itself(stage().prim_at("/A")));
    EXPECT_TRUE(is_visible_itself(stage().prim_at("/A/B")));
    EXPECT_EQ(computed_purpose(stage().prim_at("/A/B")), "proxy");
    EXPECT_EQ(computed_purpose(stage().prim_at("/A/B/C")), "render");
}

TEST_F(ViewsTest, OnlyConstantPrimvarsInherit) {
    open(R"(
def Xform "A" { color3f[] primvars:displayColor = [(1, 0, 0)] ( interpolation = "constant" )
    float[] primvars:w = [1] ( interpolation = "vertex" )
    def Mesh "M" { texCoord2f[] primvars:st = [(0, 0), (1, 1)] ( interpolation = "faceVarying";
    elementSize = 1 )
        int[] primvars:st:indices = [0, 1, 1] } }
)");
    const Prim mesh = stage().prim_at("/A/M");
    ASSERT_TRUE(find_primvar(mesh, "displayColor").has_value());
    EXPECT_FALSE(find_primvar(mesh, "w").has_value());
    const auto st = find_primvar(mesh, "st");
    ASSERT_TRUE(st.has_value());
    EXPECT_EQ(st->interpolation, Interpolation::FaceVarying);
    EXPECT_EQ(st->index_values(), (std::vector<int>{0, 1, 1}));
    EXPECT_EQ(find_primvars(mesh).size(), 2u);
}

TEST_F(ViewsTest, BindingsPurposeStrengthAndCollections) {
    open(R"(
def Scope "Looks" { def Material "Red" {} def Material "Blue" {} def Material "Full" {} }
def Xform "A" ( apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"] ) {
    rel material:binding = </Looks/Red>
    rel collection:some:includes = </A/InSome>
    rel material:binding:collection:x = [</A.collection:some>, </Looks/Blue>]
    def Mesh "Plain" {}
    def Mesh "Own" { rel material:binding = </Looks/Blue> }
    def Mesh "InSome" {}
    def Mesh "WithFull" { rel material:binding:full = </Looks/Full>;
    rel material:binding = </Looks/Blue> }
}
def Xform "S" { rel material:binding = </Looks/Red> ( bindMaterialAs = "strongerThanDescendants" )
    def Mesh "Own" { rel material:binding = </Looks/Blue> } }
def Mesh "None" {}
)");
    const auto bound = [&](const char* path, const char* purpose) {
        const Prim material = resolve_material(stage().prim_at(path), purpose).material;
        return material ? material.name().str() : std::string();
    };
    EXPECT_EQ(bound("/A/Plain", "full"), "Red");
    EXPECT_EQ(bound("/A/Own", "full"), "Blue");
    EXPECT_EQ(bound("/A/InSome", "full"), "Blue");
    EXPECT_EQ(bound("/A/WithFull", "full"), "Full");
    EXPECT_EQ(bound("/A/WithFull", "preview"), "Blue");
    EXPECT_EQ(bound("/S/Own", "full"), "Red");
    EXPECT_EQ(bound("/None", "full"), "");
}

TEST_F(ViewsTest, CollectionRulesByDepth) {
    open(R"(
def Scope "C" {
    rel collection:a:includes = [</W>, </W/Skip/Again>]
    rel collection:a:excludes = </W/Skip>
    uniform token collection:e:expansionRule = "explicitOnly"
    rel collection:e:includes = </W>
    rel collection:both:includes = [</W>, </W/Skip>]
    rel collection:both:excludes = </W/Skip>
}
)");
    const CollectionQuery a(stage().prim_at("/C"), "a");
    const auto path = [](const char* t) { return layer::Path::from(t); };
    EXPECT_TRUE(a.includes(path("/W/x/y")));
    EXPECT_FALSE(a.includes(path("/W/Skip/z")));
    EXPECT_TRUE(a.includes(path("/W/Skip/Again/z")));
    EXPECT_FALSE(a.includes(path("/Elsewhere")));
    const CollectionQuery e(stage().prim_at("/C"), "e");
    EXPECT_TRUE(e.includes(path("/W")));
    EXPECT_FALSE(e.includes(path("/W/x")));
    // Who is named by both is excluded
    const CollectionQuery both(stage().prim_at("/C"), "both");
    EXPECT_TRUE(both.includes(path("/W/x")));
    EXPECT_FALSE(both.includes(path("/W/Skip")));
    EXPECT_FALSE(both.includes(path("/W/Skip/z")));
}

}  // namespace
}  // namespace velatura::usd::stage
