// SPDX-License-Identifier: Apache-2.0
#include "base/math.h"
#include "stage_fixture.h"
#include "usd/layer/type_name.h"
#include "usd/stage/schema_tables.h"
#include "usd/stage/stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace velatura::usd::stage {
namespace {

using ValueTest = StageTest;

TEST_F(ValueTest, SamplesInterpolateByType) {
    open(R"(
def "P" {
    float f.timeSamples = { 0: 1, 10: 3 }
    int i.timeSamples = { 0: 1, 10: 3 }
    float[] same.timeSamples = { 0: [0, 2], 10: [10, 4] }
    float[] other.timeSamples = { 0: [0], 10: [10, 4] }
    quatf q.timeSamples = { 0: (1, 0, 0, 0), 10: (0, 0, 0, 1) }
    float blocked.timeSamples = { 0: 1, 5: None, 10: 2 }
    float only_default = 7
}
)");
    const Prim prim = stage().prim_at("/P");
    EXPECT_FLOAT_EQ(*prim.attribute("f").get<float>(5.0), 2.0f);
    EXPECT_FLOAT_EQ(*prim.attribute("f").get<float>(-5.0), 1.0f);
    EXPECT_FLOAT_EQ(*prim.attribute("f").get<float>(50.0), 3.0f);
    EXPECT_FALSE(prim.attribute("f").get<float>().has_value());  // no default was authored
    EXPECT_EQ(*prim.attribute("i").get<int>(9.0), 1);
    EXPECT_EQ(*prim.attribute("same").get<std::vector<float>>(5.0), (std::vector<float>{5, 3}));
    EXPECT_EQ(prim.attribute("other").get<std::vector<float>>(5.0)->size(), 1u);
    // Half of a half turn about z
    const auto q = *prim.attribute("q").get<layer::QuatFloat>(5.0);
    EXPECT_NEAR(q.r, std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(q.v.z, std::sqrt(0.5), 1e-6);
    EXPECT_FLOAT_EQ(*prim.attribute("blocked").get<float>(3.0), 1.0f);
    EXPECT_FALSE(prim.attribute("blocked").get<float>(7.0).has_value());
    EXPECT_FLOAT_EQ(*prim.attribute("blocked").get<float>(10.0), 2.0f);
    EXPECT_FLOAT_EQ(*prim.attribute("only_default").get<float>(3.0), 7.0f);
}

TEST_F(ValueTest, SamplesOffTheMiddleCountByTheirDistance) {
    // The second quaternion stands for a turn by 120 degrees about z, and has the other sign
    open(R"(
def "P" {
    double f.timeSamples = { 0: 1, 10: 5 }
    double[] list.timeSamples = { 0: [0, 8], 10: [4, 4] }
    quatd q.timeSamples = { 0: (1, 0, 0, 0), 10: (-0.5, 0, 0, -0.8660254037844386) }
}
)");
    const Prim prim = stage().prim_at("/P");
    EXPECT_DOUBLE_EQ(*prim.attribute("f").get<double>(2.5), 2.0);
    EXPECT_EQ(*prim.attribute("list").get<std::vector<double>>(2.5), (std::vector<double>{1, 7}));
    // A quarter of the short way: by 30 degrees
    const auto q = *prim.attribute("q").get<layer::QuatDouble>(2.5);
    EXPECT_NEAR(q.r, std::cos(pi_d / 12), 1e-12);
    EXPECT_NEAR(q.v.z, std::sin(pi_d / 12), 1e-12);
}

TEST_F(ValueTest, StrongerDefaultBeatsWeakerSamples) {
    write("weak.usda", "def \"P\" { float a.timeSamples = { 0: 1, 10: 2 } float b = 1 }\n");
    open(
        "( subLayers = [@weak.usda@] )\nover \"P\" { float a = 9; float b.timeSamples = { 5: 6 } "
        "}\n");
    const Prim prim = stage().prim_at("/P");
    EXPECT_FLOAT_EQ(*prim.attribute("a").get<float>(5.0), 9.0f);
    EXPECT_EQ(prim.attribute("a").value_source(), ValueSource::Default);
    EXPECT_FLOAT_EQ(*prim.attribute("b").get<float>(5.0), 6.0f);
    EXPECT_FLOAT_EQ(*prim.attribute("b").get<float>(), 1.0f);
}

TEST_F(ValueTest, BlocksUncoverTheFallback) {
    write("weak.usda", "def Sphere \"S\" { double radius = 5; double other = 2 }\n");
    open(
        "( subLayers = [@weak.usda@] )\nover \"S\" { double radius = None; double other = None "
        "}\n");
    const Prim prim = stage().prim_at("/S");
    EXPECT_DOUBLE_EQ(*prim.attribute("radius").get<double>(), 1.0);
    EXPECT_FALSE(prim.attribute("radius").has_authored_value());
    EXPECT_FALSE(prim.attribute("other").get<double>().has_value());
}

TEST_F(ValueTest, OffsetsAndRatesRetimeSamples) {
    write("sub.usda",
          "( timeCodesPerSecond = 48 )\n"
          "over \"P\" { float a.timeSamples = { 48: 1, 96: 2 } timecode t = 48 }\n");
    open("( timeCodesPerSecond = 24\n subLayers = [@sub.usda@ (offset = 10)] )\ndef \"P\" {}\n");
    const Attribute a = stage().prim_at("/P").attribute("a");
    EXPECT_EQ(a.time_samples(), (std::vector<double>{34.0, 58.0}));
    EXPECT_FLOAT_EQ(*a.get<float>(46.0), 1.5f);
    EXPECT_DOUBLE_EQ(*stage().prim_at("/P").attribute("t").get<double>(), 34.0);
}

TEST_F(ValueTest, OffsetsOfLayersInLayersCompose) {
    write("leaf.usda", "over \"P\" { float a.timeSamples = { 0: 0, 10: 10 } }\n");
    write("middle.usda", "( subLayers = [@leaf.usda@ (offset = 1; scale = 3)] )\n");
    open("( subLayers = [@middle.usda@ (offset = 10; scale = 2)] )\ndef \"P\" {}\n");
    // 10 + 2 (1 + 3t)
    const Attribute a = stage().prim_at("/P").attribute("a");
    EXPECT_EQ(a.time_samples(), (std::vector<double>{12.0, 72.0}));
    EXPECT_FLOAT_EQ(*a.get<float>(18.0), 1.0f);
}

TEST_F(ValueTest, ReferenceOffsetsCompose) {
    write("ref.usda", "def \"R\" { float a.timeSamples = { 0: 0, 10: 10 } }\n");
    open("def \"P\" ( references = @ref.usda@</R> (offset = 100; scale = 2) ) {}\n");
    EXPECT_FLOAT_EQ(*stage().prim_at("/P").attribute("a").get<float>(110.0), 5.0f);
}

TEST_F(ValueTest, ZeroRateIsClampedWithAWarning) {
    open("( timeCodesPerSecond = 0 )\ndef \"P\" { float a.timeSamples = { 0: 1 } }\n");
    EXPECT_DOUBLE_EQ(stage().time_codes_per_second(), 24.0);
    EXPECT_GE(diagnostics_.warning_count(), 1u);
}

TEST(SchemaTable, EveryFallbackIsAValueOfItsType) {
    for (const SchemaAttribute& attribute : schema_attributes()) {
        const layer::TypeInfo* type = layer::find_type(attribute.type);
        ASSERT_NE(type, nullptr) << attribute.schema << "." << attribute.name;
        if (attribute.fallback.empty()) continue;
        const auto value = schema_fallback(attribute);
        ASSERT_TRUE(value.has_value()) << attribute.schema << "." << attribute.name;
        EXPECT_EQ(value->type(), type->type) << attribute.schema << "." << attribute.name;
        EXPECT_EQ(value->is_array(), type->is_array) << attribute.schema << "." << attribute.name;
    }
}

TEST_F(ValueTest, FallbacksOfSchemas) {
    open(
        "def Mesh \"M\" {}\ndef Camera \"C\" {}\ndef DistantLight \"L\" {}\ndef SphereLight \"S\" "
        "{}\n"
        "def Shader \"Sh\" { uniform token info:id = \"UsdPreviewSurface\" }\n");
    EXPECT_EQ(*stage().prim_at("/M").attribute("subdivisionScheme").get<std::string>(),
              "catmullClark");
    EXPECT_FLOAT_EQ(*stage().prim_at("/C").attribute("focalLength").get<float>(), 50.0f);
    EXPECT_FLOAT_EQ(*stage().prim_at("/L").attribute("inputs:intensity").get<float>(), 50000.0f);
    EXPECT_FLOAT_EQ(*stage().prim_at("/S").attribute("inputs:intensity").get<float>(), 1.0f);
    EXPECT_EQ(*stage().prim_at("/Sh").attribute("inputs:diffuseColor").get<layer::Vec3f>(),
              layer::Vec3f(0.18f));
    EXPECT_FALSE(stage().prim_at("/M").attribute("nonsense").is_valid());
}

TEST_F(ValueTest, TargetsMapThroughReferencesAndOutsidersAreDropped) {
    write(
        "ref.usda",
        "def \"R\" { rel r = [</R/Child>, </Outside>]; def \"Child\" { float x; float y.connect = "
        "</R/Child.x> } }\n"
        "def \"Outside\" {}\n");
    open("def \"World\" { def \"P\" ( references = @ref.usda@</R> ) {} }\n");
    const auto targets = stage().prim_at("/World/P").relationship("r").targets();
    ASSERT_EQ(targets.size(), 1u);
    EXPECT_EQ(targets[0].to_string(), "/World/P/Child");
    EXPECT_EQ(stage().prim_at("/World/P/Child").attribute("y").connections().at(0).to_string(),
              "/World/P/Child.x");
    EXPECT_GE(diagnostics_.warning_count(), 1u);
}

TEST_F(ValueTest, OutsidersThatAStrongerLayerReplacesOrDeletesAreNoFault) {
    write("ref.usda", "def \"R\" { rel r = </Outside>; rel s = [</R/A>, </R/B>] }\n");
    open(
        "def \"P\" ( references = @ref.usda@</R> ) { rel r = </P/C>; reorder rel s = [</P/B>, "
        "</P/A>] }\n");
    const Prim p = stage().prim_at("/P");
    ASSERT_EQ(p.relationship("r").targets().size(), 1u);
    EXPECT_EQ(p.relationship("r").targets()[0].to_string(), "/P/C");
    ASSERT_EQ(p.relationship("s").targets().size(), 2u);
    EXPECT_EQ(p.relationship("s").targets()[0].to_string(), "/P/B");
    EXPECT_EQ(diagnostics_.warning_count(), 0u);
}

TEST_F(ValueTest, AttributesAndRelationshipsDoNotMix) {
    write("ref.usda", "def \"R\" { float x.connect = </R.y>; float y = 1; rel z = </R/Child> }\n");
    open("def \"P\" ( references = @ref.usda@</R> ) { rel x; float z = 2 }\n");
    const Prim p = stage().prim_at("/P");
    EXPECT_TRUE(p.relationship("x").targets().empty());
    EXPECT_TRUE(p.attribute("x").connections().empty());
    EXPECT_TRUE(p.relationship("z").targets().empty());
    EXPECT_FLOAT_EQ(*p.attribute("z").get<float>(), 2.0f);
    std::vector<std::string> found;
    for (const Diagnostic& d : diagnostics_.all())
        if (d.code == "usd-inconsistent-property") found.push_back(d.message);
    ASSERT_EQ(found.size(), 2u) << "once each";
    EXPECT_EQ(found[0], "attribute x is ignored: a stronger layer has a relationship of that name");
}

TEST_F(ValueTest, EqualInstancesShareOnePrototypeAndIgnoreLocalDescendants) {
    write("ref.usda", "def \"R\" { def \"Child\" { float a = 1 } }\n");
    open(R"(
def "A" ( instanceable = true; references = @ref.usda@</R> ) { over "Child" { float a = 2 } }
def "B" ( instanceable = true; references = @ref.usda@</R> ) {}
def "C" ( references = @ref.usda@</R> ) { over "Child" { float a = 2 } }
)");
    const Prim a = stage().prim_at("/A");
    EXPECT_TRUE(a.is_instance());
    EXPECT_EQ(stage().prim_at("/B").prototype(), a.prototype());
    EXPECT_EQ(stage().prototypes().size(), 1u);
    EXPECT_FLOAT_EQ(*stage().prim_at("/A/Child").attribute("a").get<float>(), 1.0f);
    EXPECT_FLOAT_EQ(*stage().prim_at("/B/Child").attribute("a").get<float>(), 1.0f);
    EXPECT_FLOAT_EQ(*stage().prim_at("/C/Child").attribute("a").get<float>(), 2.0f);
    EXPECT_TRUE(stage().prim_at("/B/Child").is_instance_proxy());
}

TEST_F(ValueTest, WinningOpinionKnowsItsPlace) {
    open("def \"P\"\n{\n    float a = 1\n}\n");
    const SourceLoc loc = stage().prim_at("/P").attribute("a").loc();
    EXPECT_EQ(loc.line, 5u);  // behind the magic line and the line that spread() adds
    EXPECT_GT(loc.column, 4u);
}

}  // namespace
}  // namespace velatura::usd::stage
