// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/explain.h"

#include "stage_fixture.h"

#include <gtest/gtest.h>

namespace velatura::usd::stage {
namespace {

using ExplainTest = StageTest;

/// A value that six opinions compete for: local, inherit, variant, reference, payload, specialize.
constexpr const char* contested = R"(
class "_c" {
    double x = 2
}
class "_s" {
    double x = 6
}
def "P" (
    inherits = </_c>
    specializes = </_s>
    references = @ref.usda@</R>
    payload = @load.usda@</L>
    variants = {
        string v = "a"
    }
    variantSets = "v"
) {
    double x.timeSamples = { 1: 1, 5: 9 }
    variantSet "v" = { "a" {
 double x = 3
 }
 }
}
)";

TEST_F(ExplainTest, ListsEveryOpinionStrongestFirst) {
    write("ref.usda", "def \"R\" {\n double x = 4\n }\n");
    write("load.usda", "def \"L\" {\n double x = 5\n }\n");
    open(contested);
    const auto at_three = explain(stage(), "/P.x", 3.0);
    ASSERT_TRUE(at_three.has_value());
    EXPECT_EQ(at_three->result, "5");
    std::string arcs, values, decides;
    for (const ExplainedOpinion& opinion : at_three->opinions) {
        arcs += opinion.arc + ";";
        values += opinion.value + ";";
        decides += opinion.decides ? "*" : "-";
        EXPECT_TRUE(opinion.loc.is_known() && opinion.loc.line > 0);
    }
    EXPECT_EQ(arcs, "local;inherit;variant;reference;payload;specialize;");
    EXPECT_EQ(values, "2 samples, 1: 1 ... 5: 9;2;3;4;5;6;");
    EXPECT_EQ(decides, "*-----");
    const std::string text = explanation_text(*at_three, diagnostics_);
    EXPECT_NE(text.find("root.usda:"), std::string::npos);
    EXPECT_NE(text.find("ref.usda:4:13: default = 4"), std::string::npos) << text;
    EXPECT_NE(text.find("reference </R.x>"), std::string::npos) << text;
    // At the default time the samples do not count
    const auto at_default = explain(stage(), "/P.x");
    EXPECT_EQ(at_default->result, "2");
    EXPECT_FALSE(at_default->opinions[0].decides);
    EXPECT_TRUE(at_default->opinions[1].decides);
    EXPECT_EQ(at_default->opinions[0].note, "ignored at the default time");
}

TEST_F(ExplainTest, SaysWhatIsBlockedAndWhatFallsBack) {
    open("def Sphere \"S\" {\n double radius = None\n }\ndef Sphere \"T\" {}\n");
    const auto blocked = explain(stage(), "/S.radius");
    ASSERT_TRUE(blocked.has_value());
    EXPECT_EQ(blocked->result, "1");
    EXPECT_EQ(blocked->reason, "the strongest opinion is None: the schema's fallback");
    ASSERT_EQ(blocked->opinions.size(), 2u);
    EXPECT_TRUE(blocked->opinions[0].decides && blocked->opinions[1].decides);
    const auto fallback = explain(stage(), "/T.radius", 4.0);
    EXPECT_EQ(fallback->opinions.size(), 1u);
    EXPECT_EQ(fallback->opinions[0].what, "fallback");
    EXPECT_EQ(explain(stage(), "/T.nothing").error().code, "unknown-object");
    EXPECT_EQ(explain(stage(), "/None").error().code, "unknown-object");
}

TEST_F(ExplainTest, ExplainsPrimsRelationshipsAndMetadata) {
    write("weak.usda",
          "( upAxis = \"Y\" )\ndef Mesh \"P\" ( kind = \"prop\" \n customData = { int a = 1 \n"
          "int b = 2 } ) {\n rel r = </A>\n }\n");
    open(
        "( subLayers = [@weak.usda@]\n upAxis = \"Z\" )\nover \"P\" ( kind = \"component\"\n"
        "customData = { int a = 3 } ) {\n prepend rel r = </B>\n }\n");
    const auto prim = explain(stage(), "/P");
    ASSERT_TRUE(prim.has_value());
    EXPECT_EQ(prim->subject, "/P Mesh");
    ASSERT_EQ(prim->opinions.size(), 2u);
    EXPECT_EQ(prim->opinions[0].value, "over");
    EXPECT_EQ(prim->opinions[1].value, "def Mesh");
    const auto relationship = explain(stage(), "/P.r");
    EXPECT_EQ(relationship->result, "[</B>, </A>]");
    EXPECT_EQ(relationship->opinions.size(), 2u);
    const auto kind = explain(stage(), "/P#kind");
    EXPECT_EQ(kind->result, "\"component\"");
    EXPECT_TRUE(kind->opinions[0].decides);
    EXPECT_FALSE(kind->opinions[1].decides);
    const auto data = explain(stage(), "/P#customData");
    EXPECT_EQ(data->result, "{\"a\": 3, \"b\": 2}");
    EXPECT_TRUE(data->opinions[1].decides);
    const auto axis = explain(stage(), "/#upAxis");
    EXPECT_EQ(axis->result, "\"Z\"");
    EXPECT_EQ(axis->opinions.size(), 1u);
}

TEST_F(ExplainTest, NamesClips) {
    write("clip.usda", "def \"M\" {\n double x.timeSamples = { 0: 1 }\n }\n");
    open(R"(
def "P" (
    clips = { dictionary walk = {
        asset[] assetPaths = [@./clip.usda@]
        string primPath = "/M"
        double2[] active = [(0, 0)]
    } }
) {
    double x
}
)");
    const auto explained = explain(stage(), "/P.x", 0.0);
    ASSERT_EQ(explained->opinions.size(), 1u);
    EXPECT_EQ(explained->opinions[0].what, "clips \"walk\"");
    EXPECT_TRUE(explained->opinions[0].decides);
    EXPECT_EQ(explained->result, "1");
}

TEST_F(ExplainTest, ConnectionsAndTargetsAreCombinedFromAllOpinions) {
    write("weak.usda",
          "def \"P\" {\n int c.connect = </P.x>\n append rel r = </C>\n int x = 1\n }\n");
    open(
        "( subLayers = [@weak.usda@] )\nover \"P\" {\n prepend int c.connect = </P.y>\n"
        "prepend rel r = </P>\n }\n");
    const auto connections = explain(stage(), "/P.c");
    ASSERT_TRUE(connections.has_value());
    EXPECT_NE(connections->result.find("connected to [</P.y>, </P.x>]"), std::string::npos)
        << connections->result;
    ASSERT_EQ(connections->opinions.size(), 2u);
    EXPECT_TRUE(connections->opinions[0].decides && connections->opinions[1].decides);
    for (const char* object : {"/P.r", "/P.r#targetPaths"}) {
        const auto targets = explain(stage(), object);
        ASSERT_TRUE(targets.has_value());
        EXPECT_EQ(targets->result, "[</P>, </C>]");
        EXPECT_EQ(targets->opinions.size(), 2u);
    }
    EXPECT_EQ(explain(stage(), "/P#references").error().code, "unknown-object");
}

}  // namespace
}  // namespace velatura::usd::stage
