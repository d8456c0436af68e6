// SPDX-License-Identifier: Apache-2.0
#include "test_assets.h"
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace velatura::translate::motion {

namespace {

using usd::stage::TimeCode;

const char* const identity_rest =
    "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,2,1))";

/// What differs between the arms of these tests.
struct Arm {
    std::string root_metadata;  ///< lines inside the SkelRoot, such as xformOps
    std::string animation =
        R"(uniform token[] joints = ["A/B"]
        float3[] translations = [(0, 0, 2)]
        quatf[] rotations = [(1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1)])";
    std::string skeleton;  ///< lines inside the Skeleton
    std::string indices = "[0, 0, 0, 1, 1, 1, 1, 1]";
    std::string weights = "[1, 0, 0.5, 0.5, 1, 0, 1, 0]";
    std::string mesh;  ///< lines inside the mesh
    std::string mesh_metadata = R"(prepend apiSchemas = ["SkelBindingAPI"])";
};

/// An arm along z with joints at z = 0 and z = 2, both bound where they rest; one quad with a point
/// at the elbow.
std::string arm_text(const Arm& arm) {
    return fmt::format(R"(def SkelRoot "Root" (
    prepend apiSchemas = ["SkelBindingAPI"]
) {{
    {}
    rel skel:skeleton = </Root/Skel>
    def Skeleton "Skel" (
        prepend apiSchemas = ["SkelBindingAPI"]
    ) {{
        uniform token[] joints = ["A", "A/B"]
        uniform matrix4d[] bindTransforms = [{}]
        uniform matrix4d[] restTransforms = [{}]
        rel skel:animationSource = </Root/Skel/Anim>
        {}
        def SkelAnimation "Anim" {{
            {}
        }}
    }}
    def Mesh "Mesh" (
        {}
    ) {{
        point3f[] points = [(0.3,0.1,0.7), (1,0,2), (1,0,4), (0.25,0.125,3)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0,1,2,3]
        uniform token subdivisionScheme = "none"
        int[] primvars:skel:jointIndices = {} (
            interpolation = "vertex"
            elementSize = 2
        )
        float[] primvars:skel:jointWeights = {} (
            interpolation = "vertex"
            elementSize = 2
        )
        {}
    }}
}}
)",
                       arm.root_metadata, identity_rest, identity_rest, arm.skeleton, arm.animation,
                       arm.mesh_metadata, arm.indices, arm.weights, arm.mesh);
}

const char* const bend_by_90 =
    R"(uniform token[] joints = ["A/B"]
        float3[] translations = [(0, 0, 2)]
        quatf[] rotations = [(0.70710678, 0.70710678, 0, 0)]
        half3[] scales = [(1, 1, 1)])";

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-6f) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

std::vector<Vec3> points_of(const std::string& text, TimeCode time = {}) {
    Translated t;
    TranslateOptions options;
    options.time = time;
    translate_text(text + camera(), t, options);
    EXPECT_TRUE(t.error.empty()) << t.error_message;
    for (const Diagnostic& d : t.diagnostics.all())
        if (d.severity == Severity::Warning && d.code != "no-lights")
            ADD_FAILURE() << t.diagnostics.format(d);
    return t.scene.shapes.empty() ? std::vector<Vec3>() : t.mesh(0).points;
}

/// Two instances of one arm, whose animation comes from above each of them.
std::string two_instances(const std::string& animation_of_second) {
    Arm arm;
    std::string text = arm_text(arm);
    const std::string own = "rel skel:animationSource = </Root/Skel/Anim>";
    text.erase(text.find(own), own.size());
    const std::string holder = R"(def Scope "S{}" (
    prepend apiSchemas = ["SkelBindingAPI"]
) {{
    rel skel:animationSource = {}
    def "I" (
        instanceable = true
        references = </Root>
    ) {{
    }}
}}
)";
    const std::string animations = R"(def SkelAnimation "Bend" {
    )" + std::string(bend_by_90) + R"(
}
def SkelAnimation "Straight" {
    uniform token[] joints = ["A/B"]
    float3[] translations = [(0, 0, 3)]
    quatf[] rotations = [(1, 0, 0, 0)]
    half3[] scales = [(1, 1, 1)]
}
)";
    text.replace(text.find("def SkelRoot"), 3, "class");
    return text + animations + fmt::format(fmt::runtime(holder), 1, "</Bend>") +
           fmt::format(fmt::runtime(holder), 2, animation_of_second) + camera();
}

}  // namespace

TEST(Skel, ElbowBentBy90DegreesWithHalfWeights) {
    Arm arm;
    arm.animation = bend_by_90;
    const auto points = points_of(arm_text(arm));
    ASSERT_EQ(points.size(), 4u);
    // Rotation about x by 90° around (0, 0, 2): (x, y, z) → (x, 2 − z, 2 + y)
    expect_near(points[0], Vec3(0.3f, 0.1f, 0.7f));  // joint A alone
    expect_near(points[1], Vec3(1, 0, 2));           // half and half, on the axis
    expect_near(points[2], Vec3(1, -2, 2));          // joint B alone
    expect_near(points[3], Vec3(0.25f, -1, 2.125f));
}

TEST(Skel, HalfWeightsGiveTheMiddle) {
    Arm arm;
    arm.animation = bend_by_90;
    arm.weights = "[0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]";
    arm.indices = "[0, 1, 0, 1, 0, 1, 1, 0]";
    const auto points = points_of(arm_text(arm));
    ASSERT_EQ(points.size(), 4u);
    expect_near(points[2], Vec3(1, -1, 3));
    expect_near(points[3], Vec3(0.25f, (0.125f - 1) / 2, (3 + 2.125f) / 2));
}

TEST(Skel, BindPoseIsTheAuthoredMeshBitForBit) {
    const std::string ops =
        R"(uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    double3 xformOp:translate = (1000.1, -3.3, 0.7)
    float3 xformOp:rotateXYZ = (10, 20, 31))";
    Arm arm;
    arm.root_metadata = ops;
    const auto skinned = points_of(arm_text(arm));
    arm.mesh_metadata = "kind = \"component\"";  // without the API nothing is skinned
    Translated plain;
    translate_text(arm_text(arm) + camera(), plain);
    EXPECT_EQ(plain.count("usd-skel-api"), 1u);
    ASSERT_EQ(skinned.size(), 4u);
    EXPECT_EQ(skinned, plain.mesh(0).points);
}

TEST(Skel, MovingTheSkeletonMovesWhatItMoves) {
    Arm arm;
    arm.animation = bend_by_90;
    const auto still = points_of(arm_text(arm));
    arm.skeleton = R"(uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
        double3 xformOp:translate = (5, 6, 7)
        float xformOp:rotateZ = 90)";
    // The mesh's own transform is replaced by that of the skeleton
    arm.mesh = R"(uniform token[] xformOpOrder = ["xformOp:translate"]
        double3 xformOp:translate = (100, 0, 0))";
    const auto moved = points_of(arm_text(arm));
    ASSERT_EQ(moved.size(), still.size());
    for (size_t i = 0; i < still.size(); ++i)
        expect_near(moved[i], Vec3(5 - still[i].y, 6 + still[i].x, 7 + still[i].z), 1e-5f);
}

TEST(Skel, RootJointRotationEqualsTurningTheMesh) {
    Arm arm;
    arm.animation = R"(uniform token[] joints = ["A"]
        float3[] translations = [(1, 2, 3)]
        quatf[] rotations = [(0.5, 0.5, 0.5, 0.5)]
        half3[] scales = [(2, 2, 2)])";
    const auto posed = points_of(arm_text(arm));
    // (x, y, z) → (z, x, y) is the rotation by 120° about (1, 1, 1)
    const std::vector<Vec3> rest = {{0.3f, 0.1f, 0.7f}, {1, 0, 2}, {1, 0, 4}, {0.25f, 0.125f, 3}};
    ASSERT_EQ(posed.size(), rest.size());
    for (size_t i = 0; i < rest.size(); ++i)
        expect_near(posed[i], Vec3(1 + 2 * rest[i].z, 2 + 2 * rest[i].x, 3 + 2 * rest[i].y), 2e-6f);
}

TEST(Skel, FramesThroughTimeSlerpTheJoint) {
    Arm arm;
    arm.animation = R"(uniform token[] joints = ["A/B"]
        float3[] translations = [(0, 0, 2)]
        quatf[] rotations.timeSamples = {
            1: [(1, 0, 0, 0)],
            10: [(0.70710678, 0.70710678, 0, 0)],
        }
        half3[] scales = [(1, 1, 1)])";
    for (const double time : {1.0, 4.0, 5.5, 10.0, 20.0}) {
        const auto points = points_of(arm_text(arm), TimeCode(time));
        const double angle = std::min(1.0, (time - 1) / 9) * pi_d / 2;
        ASSERT_EQ(points.size(), 4u);
        expect_near(points[2],
                    Vec3(1, float(-2 * std::sin(angle)), float(2 + 2 * std::cos(angle))));
    }
    // Without a time the samples say nothing: the joint rests
    expect_near(points_of(arm_text(arm))[2], Vec3(1, 0, 4));
}

TEST(Skel, JointOrderOfTheMeshIsMappedOntoTheSkeleton) {
    Arm arm;
    arm.animation = bend_by_90;
    const auto straight = points_of(arm_text(arm));
    arm.indices = "[1, 1, 1, 0, 0, 0, 0, 0]";
    arm.mesh = R"(uniform token[] skel:joints = ["A/B", "A"])";
    EXPECT_EQ(points_of(arm_text(arm)), straight);
}

TEST(Skel, GeomBindTransformStandsBetweenMeshAndSkeleton) {
    Arm arm;
    arm.animation = bend_by_90;
    arm.indices = "[1, 1, 1, 1, 1, 1, 1, 1]";
    arm.mesh =
        "matrix4d primvars:skel:geomBindTransform = "
        "((0,1,0,0),(-1,0,0,0),(0,0,1,0),(10,0,0,1))";
    const auto points = points_of(arm_text(arm));
    // (1, 0, 4) is bound at (10, 1, 4), then bent
    ASSERT_EQ(points.size(), 4u);
    expect_near(points[2], Vec3(10, -2, 3), 1e-5f);
}

TEST(Skel, ConstantInfluencesMoveAWholePrim) {
    const std::string text = R"(def SkelRoot "Root" {
    def Skeleton "Skel" (
        prepend apiSchemas = ["SkelBindingAPI"]
    ) {
        uniform token[] joints = ["A"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(3,4,5,1))]
    }
    def Sphere "Ball" (
        prepend apiSchemas = ["SkelBindingAPI"]
    ) {
        rel skel:skeleton = </Root/Skel>
        int[] primvars:skel:jointIndices = [0]
        float[] primvars:skel:jointWeights = [1]
        double3 xformOp:translate = (100, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
)" + camera();
    Translated t;
    translate_text(text, t);
    ASSERT_EQ(t.scene.shapes.size(), 1u) << t.error_message;
    const Mat4d& m = t.gprim(0).shape_from_gprim;
    EXPECT_EQ(Vec3d(m[3][0], m[3][1], m[3][2]), Vec3d(3, 4, 5));
    EXPECT_EQ(t.diagnostics.warning_count(), t.count("no-lights"));
}

TEST(Skel, NormalsTurnWithTheJoint) {
    Arm arm;
    arm.animation = bend_by_90;
    arm.indices = "[1, 1, 1, 1, 1, 1, 1, 1]";
    for (const char* interpolation : {"vertex", "faceVarying"}) {
        arm.mesh = fmt::format(
            "normal3f[] normals = [(0,0,1), (0,1,0), (1,0,0), (0,0,1)] (\n"
            "            interpolation = \"{}\"\n        )",
            interpolation);
        Translated t;
        translate_text(arm_text(arm) + camera(), t);
        const auto& normals = t.mesh(0).normals;
        ASSERT_EQ(normals.size(), 4u);
        expect_near(normals[0], Vec3(0, -1, 0));
        expect_near(normals[1], Vec3(0, 0, 1));
        expect_near(normals[2], Vec3(1, 0, 0));
    }
}

TEST(Skel, NormalsOfFacesBecomeNormalsOfCorners) {
    Arm arm;
    arm.animation = bend_by_90;
    arm.indices = "[0, 0, 0, 0, 1, 1, 1, 1]";
    arm.mesh =
        "normal3f[] normals = [(0,0,1)] (\n            interpolation = \"uniform\"\n        )";
    Translated t;
    translate_text(arm_text(arm) + camera(), t);
    EXPECT_EQ(t.mesh(0).normal_interpolation, scene::Interpolation::FaceVarying);
    ASSERT_EQ(t.mesh(0).normals.size(), 4u);
    expect_near(t.mesh(0).normals[0], Vec3(0, 0, 1));
    expect_near(t.mesh(0).normals[2], Vec3(0, -1, 0));
}

TEST(Skel, BlendShapesMoveListedPointsByTheirWeights) {
    Arm arm;
    arm.animation = R"(uniform token[] blendShapes = ["other", "puff"]
        float[] blendShapeWeights.timeSamples = {
            0: [1, 0],
            1: [0, 1],
            2: [0, 0.25],
        })";
    arm.mesh = R"(uniform token[] skel:blendShapes = ["puff"]
        rel skel:blendShapeTargets = </Root/Mesh/Puff>
        normal3f[] normals = [(0,0,1), (0,0,1), (0,0,1), (0,0,1)]
        def BlendShape "Puff" {
            uniform vector3f[] offsets = [(0, 8, 0), (0, 0, 4)]
            uniform vector3f[] normalOffsets = [(1, 0, 0), (0, 1, -1)]
            uniform int[] pointIndices = [2, 0]
            uniform vector3f[] inbetweens:half = [(6, 0, 0), (0, 0, 0)] (
                weight = 0.5
            )
        })";
    const std::string text = arm_text(arm);
    expect_near(points_of(text, TimeCode(0.0))[2], Vec3(1, 0, 4));
    const auto full = points_of(text, TimeCode(1.0));
    expect_near(full[2], Vec3(1, 8, 4));
    expect_near(full[0], Vec3(0.3f, 0.1f, 4.7f));
    EXPECT_EQ(full[1], Vec3(1, 0, 2));
    expect_near(points_of(text, TimeCode(2.0))[2], Vec3(4, 0, 4));

    Translated t;
    TranslateOptions options;
    options.time = TimeCode(1.0);
    translate_text(text + camera(), t, options);
    expect_near(t.mesh(0).normals[0], Vec3(0, 1, 0));
    expect_near(t.mesh(0).normals[2], Vec3(std::sqrt(0.5f), 0, std::sqrt(0.5f)));
    expect_near(t.mesh(0).normals[1], Vec3(0, 0, 1));
}

TEST(Skel, BlendShapesComeBeforeJoints) {
    Arm arm;
    arm.animation = std::string(bend_by_90) + R"(
        uniform token[] blendShapes = ["puff"]
        float[] blendShapeWeights = [1])";
    arm.indices = "[1, 1, 1, 1, 1, 1, 1, 1]";
    arm.mesh = R"(uniform token[] skel:blendShapes = ["puff"]
        rel skel:blendShapeTargets = </Root/Mesh/Puff>
        def BlendShape "Puff" {
            uniform vector3f[] offsets = [(0, 0, 0), (0, 0, 0), (0, 0, 1), (0, 0, 0)]
        })";
    expect_near(points_of(arm_text(arm))[2], Vec3(1, -3, 2));
}

TEST(Skel, WhatDoesNotFitIsNamedAndLeavesTheMeshAsItIs) {
    struct Case {
        const char* what;
        Arm arm;
        const char* code;
    };

    std::vector<Case> cases(6);
    cases[0] = {"index", {}, "bad-skel-binding"};
    cases[0].arm.indices = "[0, 7, 0, 1, 1, 1, 1, 1]";
    cases[0].arm.weights = "[0.5, 0.5, 0.5, 0.5, 1, 0, 1, 0]";
    cases[1] = {"count", {}, "bad-skel-binding"};
    cases[1].arm.indices = "[0, 1]";
    cases[2] = {"order", {}, "bad-skel-binding"};
    cases[2].arm.mesh = "uniform token[] skel:joints = [\"A\", \"Nobody\"]";
    cases[3] = {"animation", {}, "usd-skel-animation"};
    cases[3].arm.animation =
        "uniform token[] joints = [\"A\", \"A/B\"]\n"
        "float3[] translations = [(0, 0, 0)]\n"
        "quatf[] rotations = [(1, 0, 0, 0)]\n"
        "half3[] scales = [(1, 1, 1)]";
    cases[4] = {"method", {}, "bad-skel-binding"};
    cases[4].arm.mesh = "uniform token primvars:skel:skinningMethod = \"magic\"";
    cases[5] = {"shapes", {}, "bad-blend-shapes"};
    cases[5].arm.mesh = "uniform token[] skel:blendShapes = [\"a\", \"b\"]";
    for (const Case& c : cases) {
        Translated t;
        translate_text(arm_text(c.arm) + camera(), t);
        EXPECT_EQ(t.count(c.code), 1u) << c.what;
        ASSERT_EQ(t.scene.shapes.size(), 1u) << c.what;
        expect_near(t.mesh(0).points[2], Vec3(1, 0, 4));
    }
}

TEST(Skel, SkeletonWithoutRestPosesOnlyWhatIsAnimated) {
    const std::string text = R"(def SkelRoot "Root" (
    prepend apiSchemas = ["SkelBindingAPI"]
) {
    def Skeleton "Skel" {
        uniform token[] joints = ["A"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
    }
    rel skel:skeleton = </Root/Skel>
)" + quad("Q", R"(
    int[] primvars:skel:jointIndices = [0]
    float[] primvars:skel:jointWeights = [1])") +
                             "}\n" + camera();
    Translated t;
    std::string bound = text;
    bound.replace(bound.find("def Mesh \"Q\" {"), 14,
                  "def Mesh \"Q\" (\n prepend apiSchemas = [\"SkelBindingAPI\"]\n) {");
    translate_text(bound, t);
    EXPECT_EQ(t.count("usd-skel-rest"), 1u) << t.error_message;
    ASSERT_EQ(t.scene.shapes.size(), 1u);
}

TEST(Skel, InstancesShareTheirPoseOnlyWhenTheyAnimateAlike) {
    Translated alike;
    translate_text(two_instances("</Bend>"), alike);
    EXPECT_EQ(alike.scene.prototypes.size(), 1u) << alike.error_message;
    EXPECT_EQ(alike.count("duplicate-instances"), 1u);

    Translated different;
    translate_text(two_instances("</Straight>"), different);
    ASSERT_EQ(different.scene.prototypes.size(), 2u) << different.error_message;
    ASSERT_EQ(different.scene.instances.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        const scene::Instance& instance = different.scene.instances[i];
        const auto& shape = different.scene.prototypes[instance.prototype].shapes[0];
        const Vec3 p = transform_point(std::get<scene::Mesh>(shape.geometry).points[2],
                                       instance.render_from_prototype);
        expect_near(p, i == 0 ? Vec3(1, -2, 2) : Vec3(1, 0, 5));
    }
}

TEST(Skel, SkeletonOutsideOfAnInstanceIsMetWhereItStands) {
    // The mesh is instanced twice under one skeleton: both are drawn where the skeleton puts them
    const std::string text = R"(class Xform "Body" {
)" + quad("Q") + R"(}
def SkelRoot "Root" (
    prepend apiSchemas = ["SkelBindingAPI"]
) {
    rel skel:skeleton = </Root/Skel>
    int[] primvars:skel:jointIndices = [0]
    float[] primvars:skel:jointWeights = [1]
    def Skeleton "Skel" {
        uniform token[] joints = ["A"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,9,1))]
    }
    def "One" (
        instanceable = true
        references = </Body>
    ) {
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def "Two" (
        instanceable = true
        references = </Body>
    ) {
        double3 xformOp:translate = (0, 7, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
)" + camera();
    Translated t;
    translate_text(text, t);
    ASSERT_EQ(t.scene.instances.size(), 2u) << t.error_message;
    for (const scene::Instance& instance : t.scene.instances) {
        const auto& shape = t.scene.prototypes[instance.prototype].shapes[0];
        const Vec3 p = transform_point(std::get<scene::Mesh>(shape.geometry).points[2],
                                       instance.render_from_prototype);
        expect_near(p, Vec3(1, 1, 9));
    }
}

TEST(Skel, PixarsBlendShapesReachTheirGroundTruth) {
    const std::filesystem::path file =
        test_assets() / "openusd/imaging/testUsdImagingGLSkelBlendShapes/blendshapes.usda";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
    for (const double time : {1.0, 2.0, 3.0}) {
        Diagnostics diagnostics;
        auto stage = usd::stage::Stage::open(file.string(), {}, diagnostics);
        ASSERT_TRUE(stage) << stage.error().message;
        TranslateOptions options;
        options.time = TimeCode(time);
        const auto scene = translate_stage(*stage, options, diagnostics);
        ASSERT_TRUE(scene) << scene.error().message;
        ASSERT_EQ(scene->shapes.size(), 2u);
        const auto& truth = std::get<scene::Mesh>(scene->shapes[0].geometry).points;
        const auto& posed = std::get<scene::Mesh>(scene->shapes[1].geometry).points;
        ASSERT_EQ(truth.size(), posed.size());
        for (size_t i = 0; i < truth.size(); ++i)
            // The truth went through sums in float: sizes of 20 and several shapes at once
            expect_near(posed[i], truth[i] - Vec3(12, 0, 0), 1e-4f);
    }
}

}  // namespace velatura::translate::motion
