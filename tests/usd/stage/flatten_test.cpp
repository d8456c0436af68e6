// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/flatten.h"

#include "stage_fixture.h"
#include "usd/text/writer.h"

#include <gtest/gtest.h>

namespace velatura::usd::stage {
namespace {

class FlattenTest : public StageTest {
  protected:
    std::string flat(const FlattenOptions& options = {}) {
        return text::write_text_layer(*flatten_stage(stage(), options));
    }

    bool flat_has(const std::string& part, const FlattenOptions& options = {}) {
        const std::string text = flat(options);
        const bool has = text.find(part) != std::string::npos;
        if (!has) ADD_FAILURE() << "not found: " << part << "\n" << text;
        return has;
    }
};

TEST_F(FlattenTest, ArcsBecomeOneLayer) {
    std::filesystem::create_directory(folder_ / "sub");
    write("sub/ref.usda",
          "def Xform \"R\" ( kind = \"component\" ) {\n asset a = @./t.png@\n"
          "double x.timeSamples = { 0: 1, 10: 2 }\n }\n");
    open("def \"P\" ( references = @sub/ref.usda@</R> (offset = 5; scale = 2) ) {}\n");
    EXPECT_TRUE(flat_has("def Xform \"P\""));
    EXPECT_TRUE(flat_has("5: 1"));
    EXPECT_TRUE(flat_has("25: 2"));
    EXPECT_TRUE(flat_has("@" + (folder_ / "sub/t.png").string() + "@"));
    EXPECT_TRUE(flat_has("@./sub/t.png@", {folder_.string()}));
    EXPECT_EQ(flat().find("references"), std::string::npos);
}

TEST_F(FlattenTest, NothingIsLost) {
    write("weak.usda",
          "def \"P\" ( \n mine = [1, 2] \n ) {\n double x = 1\n float c.connect = [</P.x>]\n }\n");
    open(
        "( subLayers = [@weak.usda@] )\nover \"P\" {\n double x = None\n"
        "float c.connect = None\n }\ndef \"Off\" ( active = false ) {\n double y = 1\n }\n"
        "over \"O\" {}\nclass \"C\" {}\n");
    EXPECT_TRUE(flat_has("mine = [1, 2]"));
    EXPECT_TRUE(flat_has("double x = None"));
    EXPECT_TRUE(flat_has("c.connect = None"));
    EXPECT_TRUE(flat_has("active = false"));
    EXPECT_TRUE(flat_has("double y = 1"));
    EXPECT_TRUE(flat_has("over \"O\""));
    EXPECT_TRUE(flat_has("class \"C\""));
}

TEST_F(FlattenTest, InstancesShareAPrototype) {
    write("ref.usda",
          "def \"R\" {\n rel inner = </R/Geo>\n def \"Geo\" {\n rel self = </R/Geo>\n }\n }\n");
    open(
        "def \"A\" ( references = @ref.usda@</R>\n instanceable = true ) {}\n"
        "def \"B\" ( references = @ref.usda@</R>\n instanceable = true ) {\n double own = 1\n }\n");
    const std::string text = flat();
    EXPECT_EQ(text.find("Flattened_Prototype_2"), std::string::npos);
    EXPECT_NE(text.find("over \"Flattened_Prototype_1\""), std::string::npos);
    EXPECT_NE(text.find("rel self = </Flattened_Prototype_1/Geo>"), std::string::npos) << text;
    EXPECT_NE(text.find("rel inner = </A/Geo>"), std::string::npos) << text;
    std::ofstream(folder_ / "flat.usda") << text;
    Diagnostics diagnostics;
    const auto again = Stage::open((folder_ / "flat.usda").string(), {}, diagnostics);
    ASSERT_TRUE(again.has_value());
    EXPECT_TRUE(again->prim_at("/A").is_instance());
    EXPECT_EQ(again->prim_at("/B").prototype(), again->prim_at("/A"));
    EXPECT_EQ(again->prim_at("/B/Geo").relationship("self").targets().front().to_string(),
              "/B/Geo");
}

TEST_F(FlattenTest, ClipsAreBakedAndExpressionsEvaluated) {
    write("clip.usda", "def \"M\" {\n double x.timeSamples = { 0: 1, 4: 2 }\n }\n");
    open(R"(
( expressionVariables = { string TEX = "wood" } )
def "P" (
    clips = { dictionary default = {
        asset[] assetPaths = [@./clip.usda@]
        string primPath = "/M"
        double2[] active = [(0, 0)]
    } }
) {
    double x
    asset a = @`"./${TEX}.png"`@
}
)");
    EXPECT_TRUE(flat_has("4: 2"));
    EXPECT_TRUE(flat_has("@./wood.png@", {folder_.string()}));
    EXPECT_EQ(stage().prim_at("/P").attribute("a").resolved_asset_path(),
              (folder_ / "wood.png").string());
}

TEST_F(FlattenTest, VariantsKeepTheirSelection) {
    open(R"(
def "P" (
    variants = {
        string v = "b"
    }
    variantSets = "v"
) {
    variantSet "v" = { "a" {
 double x = 1
 }
 "b" {
 double x = 2
 }
 }
}
)");
    EXPECT_TRUE(flat_has("double x = 2"));
    EXPECT_TRUE(flat_has("string v = \"b\""));
    EXPECT_EQ(flat().find("double x = 1"), std::string::npos);
}

TEST_F(FlattenTest, PathExpressionsSpeakOfTheStage) {
    write("asset.usda", R"(
def "Asset" {
 pathExpression a = "/Asset/Geo//"
 pathExpression b = "/Asset/Geo/S*{isa:Sphere} - (/Asset/Geo/Skin + ../Elsewhere/x) %/Asset:c %:c"
 def "Geo" {
 pathExpression self = "/Asset/Geo"
 }
 }
)");
    open(
        "def \"W\" {\n def \"A\" ( references = @asset.usda@</Asset> ) {}\n }\n"
        "def \"I\" ( references = @asset.usda@</Asset>\n instanceable = true ) {}\n");
    EXPECT_TRUE(flat_has("pathExpression a = \"/W/A/Geo//\""));
    EXPECT_TRUE(flat_has("\"/W/A/Geo/S*{isa:Sphere} - (/W/A/Geo/Skin + (~//)) %/W/A:c %:c\""));
    EXPECT_TRUE(flat_has("pathExpression self = \"/Flattened_Prototype_1/Geo\""));
    EXPECT_EQ(stage().prim_at("/W/A").attribute("a").value().get_if<layer::PathExpression>()->text,
              "/W/A/Geo//");
}

TEST_F(FlattenTest, TimeCodesOfMetadataAreRetimed) {
    write(
        "ref.usda",
        "def \"R\" ( customData = {\n timecode t = 48\n dictionary d = {\n timecode[] u = [1, 2]\n"
        "}\n } ) {\n timecode x = 48 ( customData = {\n timecode t = 4\n } )\n }\n");
    open("def \"P\" ( references = @ref.usda@</R> (offset = 10; scale = 2) ) {}\n");
    const auto data = stage().prim_at("/P").metadata("customData");
    ASSERT_TRUE(data);
    const auto* dictionary = data->get_if<layer::Dictionary>();
    EXPECT_EQ(dictionary->find("t")->get_if<layer::TimeCodeValue>()->value, 106.0);
    EXPECT_EQ(dictionary->find("d")
                  ->get_if<layer::Dictionary>()
                  ->find("u")
                  ->as_array<layer::TimeCodeValue>()[1]
                  .value,
              14.0);
    EXPECT_TRUE(flat_has("timecode t = 106"));
    EXPECT_TRUE(flat_has("timecode t = 18"));
    EXPECT_TRUE(flat_has("timecode x = 106"));
}

TEST_F(FlattenTest, SearchPathsThatFindNothingAndAbsolutePathsStay) {
    open(
        "def \"P\" {\n asset a = @missing.png@\n asset b = @/abs/x.png@\n asset c = @./near.png@\n "
        "}\n");
    const FlattenOptions elsewhere{(folder_ / "out").string()};
    EXPECT_TRUE(flat_has("asset a = @missing.png@", elsewhere));
    EXPECT_TRUE(flat_has("asset b = @/abs/x.png@", elsewhere));
    EXPECT_TRUE(flat_has("asset c = @../near.png@", elsewhere));
}

TEST_F(FlattenTest, RetimedSplinesGetNoLoopOfTheirOwn) {
    write("ref.usda",
          "def \"R\" {\n double x.spline = {\n bezier,\n 0: 1; post linear,\n 4: 2,\n }\n }\n");
    open("def \"P\" ( references = @ref.usda@</R> (offset = 10) ) {}\n");
    EXPECT_TRUE(flat_has("10: 1"));
    EXPECT_EQ(flat().find("loop"), std::string::npos);
}

TEST_F(FlattenTest, SplinesWithoutKnotsStayAndHideNothing) {
    write("weak.usda",
          "def \"P\" {\n double y.spline = {\n 1: 5,\n }\n double z = 7\n double w.spline = {\n }\n"
          "double v.spline = {\n }\n }\n");
    open(
        "( subLayers = [@weak.usda@ (scale = 2)] )\nover \"P\" {\n double x.spline = {\n post: "
        "sloped(4),\n }\n double y.spline = {\n }\n double z.spline = {\n }\n double w = None\n "
        "}\n");
    EXPECT_TRUE(flat_has("double x.spline = {\n        post: sloped(4),\n    }\n"));
    // What has a value keeps it
    EXPECT_TRUE(flat_has("2: 5"));
    EXPECT_TRUE(flat_has("double z = 7\n    double z.spline = {\n    }\n"));
    EXPECT_EQ(stage().prim_at("/P").attribute("z").get<double>(), 7.0);
    EXPECT_TRUE(flat_has("double v.spline = {\n    }\n"));
    // Nothing shows through a block
    EXPECT_EQ(flat().find("w.spline"), std::string::npos);
}

}  // namespace
}  // namespace velatura::usd::stage
