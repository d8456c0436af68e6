// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/collection.h"

#include "stage_fixture.h"

#include <gtest/gtest.h>

// Oracle: the rules in the documentation of Pixar's SdfPathExpression and UsdCollectionAPI.

namespace velatura::usd::stage {
namespace {

TEST(Glob, MatchesNames) {
    EXPECT_TRUE(glob_matches("bar*", "bar"));
    EXPECT_TRUE(glob_matches("*a*b", "xaayb"));
    EXPECT_FALSE(glob_matches("a?c", "ac"));
    EXPECT_TRUE(glob_matches("a[0-9]c", "a5c"));
    EXPECT_FALSE(glob_matches("a[!0-9]c", "a5c"));
    EXPECT_TRUE(glob_matches("[xyz]", "y"));
    EXPECT_FALSE(glob_matches("*a", std::string(10000, 'b')));
}

class CollectionTest : public StageTest {
  protected:
    /// Paths of all prims below the root that the collection /Sets:c holds, given its expression.
    std::string members(const std::string& expression) {
        open(scene("pathExpression collection:c:membershipExpression = \"" + expression + "\""));
        return members_of("c");
    }

    std::string scene(const std::string& body) {
        return R"(
def "World" (
    kind = "group"
) {
    def Xform "Car" (
        kind = "component"
        variants = {
            string color = "red"
        }
        variantSets = "color"
    ) {
        def Mesh "Body" {}
        def Sphere "Wheel1" {}
        def Sphere "Wheel2" {}
        variantSet "color" = { "red" {}
 }
    }
    over "Ghost" { def Mesh "Body" {} }
}
def "Sets" {
)" + body + "\n}\n";
    }

    std::string members_of(const std::string& name) {
        const CollectionQuery query(stage().prim_at("/Sets"), name);
        std::string text;
        std::vector<Prim> open_prims = stage().pseudo_root().all_children();
        while (!open_prims.empty()) {
            const Prim prim = open_prims.front();
            open_prims.erase(open_prims.begin());
            if (query.includes(prim.path())) text += prim.name().str() + " ";
            const auto children = prim.all_children();
            open_prims.insert(open_prims.begin(), children.begin(), children.end());
        }
        return text;
    }
};

TEST_F(CollectionTest, PatternsWithWildcardsAndStretches) {
    EXPECT_EQ(members("/World/Car"), "Car ");
    EXPECT_EQ(members("/World/Car//"), "Car Body Wheel1 Wheel2 ");
    EXPECT_EQ(members("/World/Car/*"), "Body Wheel1 Wheel2 ");
    EXPECT_EQ(members("//Wheel?"), "Wheel1 Wheel2 ");
    EXPECT_EQ(members("//Body"), "Body Body ");
    EXPECT_EQ(members("/World/*/Body"), "Body Body ");
    EXPECT_EQ(members("//"), "World Car Body Wheel1 Wheel2 Ghost Body Sets ");
    EXPECT_EQ(members("../World/Car"), "Car ");
    EXPECT_EQ(members("."), "Sets ");
    EXPECT_EQ(members("/Nothing//"), "");
}

TEST_F(CollectionTest, SetOperatorsInTheirOrder) {
    EXPECT_EQ(members("//Wheel1 + /World/Car"), "Car Wheel1 ");
    EXPECT_EQ(members("//Wheel1 /World/Car"), "Car Wheel1 ");
    EXPECT_EQ(members("/World/Car// - //Wheel*"), "Car Body ");
    EXPECT_EQ(members("/World/Car// & //Body"), "Body ");
    EXPECT_EQ(members("~/World//"), "Sets ");
    // Differences last: (a & b) - (c + d)
    EXPECT_EQ(members("/World// & /World/Car// - //Wheel1 + //Wheel2"), "Car Body ");
    EXPECT_EQ(members("/World/Car// - (//Wheel1 + //Body)"), "Car Wheel2 ");
}

TEST_F(CollectionTest, Predicates) {
    EXPECT_EQ(members("//{isa:Gprim}"), "Body Wheel1 Wheel2 Body ");
    EXPECT_EQ(members("//{isa(Gprim, strict=true)}"), "");
    EXPECT_EQ(members("/World//{isa:Sphere}"), "Wheel1 Wheel2 ");
    EXPECT_EQ(members("//*{kind:model}"), "World Car ");
    EXPECT_EQ(members("//*{kind(model, strict=true)}"), "");
    EXPECT_EQ(members("//*{not defined}"), "Ghost Body ");
    EXPECT_EQ(members("//*{specifier:over}"), "Ghost ");
    EXPECT_EQ(members("//*{variant(color=\\\"r*\\\")}"), "Car ");
    EXPECT_EQ(members("//Wheel*{isa:Sphere and not abstract} - //Wheel1"), "Wheel2 ");
    EXPECT_EQ(members("//*{isa:Sphere or isa:Mesh}"), "Body Wheel1 Wheel2 Body ");
    EXPECT_EQ(members("//Car{model}/Body"), "Body ");
}

TEST_F(CollectionTest, ErrorsMatchNothingAndAreNamed) {
    EXPECT_EQ(members("/World/("), "");
    EXPECT_EQ(members("//{shiny}"), "");
    size_t warnings = 0;
    for (const Diagnostic& d : diagnostics_.all()) warnings += d.code == "usd-path-expression";
    EXPECT_EQ(warnings, 2u);
}

TEST_F(CollectionTest, RefersToOtherCollections) {
    open(scene(R"(
    pathExpression collection:c:membershipExpression = "%:d - //Wheel2 + %/Sets:rules"
    pathExpression collection:d:membershipExpression = "/World/Car//"
    rel collection:rules:includes = </World/Ghost>
)"));
    EXPECT_EQ(members_of("c"), "Car Body Wheel1 ");
    open(scene(R"(
    pathExpression collection:c:membershipExpression = "(%:d - //Wheel2) + %/Sets:rules"
    pathExpression collection:d:membershipExpression = "/World/Car//"
    rel collection:rules:includes = </World/Ghost>
)"));
    EXPECT_EQ(members_of("c"), "Car Body Wheel1 Ghost Body ");
}

TEST_F(CollectionTest, CyclesEndWithAnError) {
    open(scene(R"(
    pathExpression collection:c:membershipExpression = "%:d + /World"
    pathExpression collection:d:membershipExpression = "%:c + /World/Car"
)"));
    EXPECT_EQ(members_of("c"), "World Car ");
    EXPECT_GT(diagnostics_.error_count(), 0u);
}

TEST_F(CollectionTest, WeakerOpinionsComeInWherePercentUnderscoreStands) {
    write("weak.usda",
          "def \"Sets\" { pathExpression collection:c:membershipExpression = \"//Wheel1\" }\n");
    open("( subLayers = [@weak.usda@] )\n" +
         scene("pathExpression collection:c:membershipExpression = \"%_ + /World/Car\""));
    EXPECT_EQ(members_of("c"), "Car Wheel1 ");
}

TEST_F(CollectionTest, ReferencesMapTheirPaths) {
    write("ref.usda",
          "def \"Asset\" { pathExpression collection:c:membershipExpression = \"/Asset//\"\n"
          "def \"Geo\" {} }\n");
    open("def \"Sets\" ( references = @ref.usda@</Asset> ) {}\n");
    EXPECT_EQ(members_of("c"), "Sets Geo ");
}

}  // namespace
}  // namespace velatura::usd::stage
