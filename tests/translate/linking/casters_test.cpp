// SPDX-License-Identifier: Apache-2.0
// What things are called in shadows by caster: by a name that the scene gives, by models, by
// themselves.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace velatura::translate::linking {

namespace {

std::string name_of(const scene::Casters& casters, scene::CasterId id) {
    if (id == scene::none) return "-";
    const scene::Caster& c = casters.list[id];
    return c.prim.empty() ? "'" + c.name + "'" : c.prim;
}

/// Of the shapes placed directly, then of those of every instance.
std::string casters_of(const std::string& text, Translated& out) {
    TranslateOptions options;
    options.finds_casters = true;
    translate_text(text + camera(), out, options);
    std::string names;
    const scene::Casters& casters = out.scene.casters;
    for (uint32_t s = 0; s < out.scene.shapes.size(); ++s)
        names += name_of(casters, casters.of(scene::none, s)) + " ";
    for (uint32_t i = 0; i < out.scene.instances.size(); ++i) {
        for (uint32_t s = 0;
             s < out.scene.prototypes[out.scene.instances[i].prototype].shapes.size(); ++s)
            names += name_of(casters, casters.of(i, s)) + " ";
    }
    return names;
}

std::string casters_of(const std::string& text) {
    Translated out;
    return casters_of(text, out);
}

std::string xform(const std::string& name, const std::string& metadata, const std::string& body) {
    return "def Xform \"" + name + "\" (" + metadata + ") {\n" + body + "\n}\n";
}

}  // namespace

TEST(Casters, AreComponentsElsePrims) {
    EXPECT_EQ(casters_of(quad("Wall")), "/Wall ");
    EXPECT_EQ(casters_of(xform("Set", "", quad("Wall"))), "/Set ");
    const std::string chair =
        xform("Chair", "kind = \"component\"",
              quad("Leg") + xform("Seat", "kind = \"subcomponent\"", quad("Cushion")));
    EXPECT_EQ(casters_of(chair + quad("Wall")), "/Chair /Chair /Wall ");
    EXPECT_EQ(casters_of(xform("Set", "kind = \"group\"", chair + quad("Wall"))),
              "/Set/Chair /Set/Chair /Set/Wall ");
    // Also where the prims above make no chain of models: the most common slip
    EXPECT_EQ(casters_of(xform("Set", "", chair + quad("Wall"))),
              "/Set/Chair /Set/Chair /Set/Wall ");
    // A component within another is a part of it
    EXPECT_EQ(casters_of(xform("Room", "kind = \"component\"", chair) + quad("Wall")),
              "/Room /Room /Wall ");
}

// What stands beside components is told apart from them, and from its like
TEST(Casters, BesideComponentsAreThePrimsOfTheSameGroup) {
    const std::string chair = xform("Chair", "kind = \"component\"", quad("Leg"));
    const std::string vase = xform("Vase", "", quad("Foot") + quad("Neck"));
    // Many components already: the loose things are divided where a component stands among them
    // (World, Set), and no further (Vase, Shelf)
    std::string chairs;
    for (int i = 0; i < 8; ++i)
        chairs += xform(fmt::format("C{}", i), "kind = \"component\"", quad("Leg"));
    EXPECT_EQ(casters_of(xform("World", "kind = \"assembly\"",
                               xform("Set", "kind = \"group\"", chairs + quad("Floor") + vase) +
                                   xform("Shelf", "", quad("A") + quad("B")))),
              "/World/Set/C0 /World/Set/C1 /World/Set/C2 /World/Set/C3 /World/Set/C4 "
              "/World/Set/C5 /World/Set/C6 /World/Set/C7 /World/Set/Floor /World/Set/Vase "
              "/World/Set/Vase /World/Shelf /World/Shelf ");
    // Few: groups are divided, too
    EXPECT_EQ(casters_of(xform("World", "", chair + vase)),
              "/World/Chair /World/Vase/Foot /World/Vase/Neck ");
}

// By level, until there are 8: of two groups with four things each the things, of eight groups the
// groups. Never to more than 64: a group that is too large stays whole and others do not.
TEST(Casters, AreDividedByLevelsAsFarAsItHelps) {
    const auto group = [](const std::string& name, int things) {
        std::string body;
        for (int i = 0; i < things; ++i) body += quad(fmt::format("T{:03}", i));
        return xform(name, "", body);
    };
    const auto count = [&](const std::string& text) {
        Translated out;
        casters_of(text, out);
        EXPECT_EQ(out.count("many-casters"), 0u);
        return out.scene.casters.list.size();
    };
    EXPECT_EQ(count(xform("World", "", group("A", 4) + group("B", 4))), 8u);
    std::string eight;
    for (int i = 0; i < 8; ++i) eight += group(fmt::format("G{}", i), 5);
    EXPECT_EQ(count(xform("World", "", eight)), 8u);
    EXPECT_EQ(count(xform("World", "", group("A", 63) + group("B", 1))), 64u);
    EXPECT_EQ(count(xform("World", "", group("A", 64) + group("B", 5))), 6u);
    EXPECT_EQ(count(xform("World", "", group("A", 5) + group("B", 100) + group("C", 5))), 11u);
}

// One model around everything would be the only caster, and no shadow could be chosen: its parts
// are told apart
TEST(Casters, BelowALoneRootAreItsParts) {
    const std::string assembly = "kind = \"assembly\"", component = "kind = \"component\"";
    const std::string vase = xform("Vase", "", quad("Foot") + quad("Neck"));
    for (const std::string& kind : {assembly, component})
        EXPECT_EQ(casters_of(xform("World", kind, quad("Floor") + vase)),
                  "/World/Floor /World/Vase/Foot /World/Vase/Neck ");
    // Through prims that hold everything, too
    EXPECT_EQ(casters_of(xform("World", assembly, xform("Geo", "", quad("Floor") + vase))),
              "/World/Geo/Floor /World/Geo/Vase/Foot /World/Geo/Vase/Neck ");
    // Models below it are found as ever, and subcomponents are the models of a component
    EXPECT_EQ(casters_of(
                  xform("World", assembly, quad("Floor") + xform("Vase", component, quad("Foot")))),
              "/World/Floor /World/Vase ");
    EXPECT_EQ(casters_of(xform(
                  "World", component,
                  xform("Set", "",
                        xform("Chair", "kind = \"subcomponent\"", quad("Leg") + quad("Seat")) +
                            quad("Wall")))),
              "/World/Set/Chair /World/Set/Chair /World/Set/Wall ");
    // What cannot be divided stays what it is called
    EXPECT_EQ(casters_of(xform("World", assembly, xform("Geo", "", quad("Floor")))), "/World ");
    // Instances go by where they are
    const std::string prototype = "class \"_Tree\" {\n" + quad("Leaf") + quad("Stem") + "}\n";
    const std::string tree = "instanceable = true\n inherits = </_Tree>";
    EXPECT_EQ(casters_of(prototype +
                         xform("World", component, xform("A", tree, "") + xform("B", tree, ""))),
              "/World/A /World/A /World/B /World/B ");
    // What the scene names stays as named
    EXPECT_EQ(
        casters_of(xform("World", assembly,
                         quad("Floor") + quad("Vase", "string velatura:shadow:caster = \"vase\""))),
        "/World/Floor 'vase' ");
}

TEST(Casters, ByPatternsAreThosePrimsAndTheRest) {
    const std::string world =
        xform("World", "kind = \"component\"",
              quad("Floor", "string velatura:shadow:caster = \"ground\"") +
                  xform("Trees", "", quad("Oak") + xform("Elm", "", quad("Leaf") + quad("Stem"))));

    const struct {
        std::vector<std::string> patterns;
        const char* casters;
        size_t warnings;
    } cases[] = {
        {{"/World/Trees/*"}, "- /World/Trees/Elm /World/Trees/Elm /World/Trees/Oak ", 0},
        {{"/World/Trees"}, "- /World/Trees /World/Trees /World/Trees ", 0},
        {{"//Stem", "/World/Floor"}, "/World/Floor - /World/Trees/Elm/Stem - ", 0},
        // The nearest one counts
        {{"/World", "//Elm"}, "/World /World/Trees/Elm /World/Trees/Elm /World ", 0},
        {{"/World/Trees/* - //Oak"}, "- /World/Trees/Elm /World/Trees/Elm - ", 0},
        {{"/World/Trees//{isa:Mesh}"},
         "- /World/Trees/Elm/Leaf /World/Trees/Elm/Stem /World/Trees/Oak ",
         0},
        {{"/World/Rocks", "//Oak"}, "- - - /World/Trees/Oak ", 1},
    };

    for (const auto& c : cases) {
        Translated out;
        TranslateOptions options;
        options.finds_casters = true;
        options.casters = c.patterns;
        translate_text(world + camera(), out, options);
        std::string names;
        for (uint32_t s = 0; s < out.scene.shapes.size(); ++s)
            names += name_of(out.scene.casters, out.scene.casters.of(scene::none, s)) + " ";
        EXPECT_EQ(names, c.casters) << c.patterns.front();
        EXPECT_EQ(out.count("casters"), c.warnings) << c.patterns.front();
    }
}

TEST(Casters, AreCalledAsTheSceneSays) {
    const std::string chair = xform("Chair", "kind = \"component\"",
                                    "string velatura:shadow:caster = \"seats\"\n" + quad("Leg") +
                                        quad("Back", "token velatura:shadow:caster = \"backs\""));
    EXPECT_EQ(casters_of(chair + quad("Stool", "string velatura:shadow:caster = \"seats\"")),
              "'backs' 'seats' 'seats' ");
    Translated out;
    casters_of(chair + quad("Stool", "string velatura:shadow:caster = \"seats\""), out);
    EXPECT_EQ(out.scene.casters.list.size(), 2u);
}

TEST(Casters, OfInstancesGoByTheirPlace) {
    const std::string prototype = "class \"_Tree\" {\n" + quad("Leaf") +
                                  quad("Stem", "string velatura:shadow:caster = \"stems\"") + "}\n";
    const std::string tree = "instanceable = true\n inherits = </_Tree>\n kind = \"component\"";
    EXPECT_EQ(casters_of(prototype + xform("A", tree, "") + xform("B", tree, "")),
              "/A 'stems' /B 'stems' ");
    const auto swarm = [](const std::string& more) {
        return "def PointInstancer \"Swarm\" (kind = \"component\") {\n int[] protoIndices = [0, "
               "0]\n point3f[] positions = [(0, 0, 0), (1, 0, 0)]\n rel prototypes = "
               "</Protos/Bee>\n" +
               more + "}\n" + "def Scope \"Protos\" {\n" + xform("Bee", "", quad("Wing")) + "}\n";
    };
    // The prototype says nothing of its own; the instancer is a component
    Translated out;
    const std::string bees = casters_of(swarm(""), out);
    EXPECT_NE(bees.find("/Swarm /Swarm"), std::string::npos) << bees;
    EXPECT_NE(casters_of(swarm("string velatura:shadow:caster = \"bees\"\n")).find("'bees' 'bees'"),
              std::string::npos);
}

TEST(Casters, AreWarnedOfWhenTheyAreMany) {
    std::string text;
    for (int i = 0; i < 64; ++i) text += quad(fmt::format("Q{}", i));
    Translated few, many;
    casters_of(text, few);
    casters_of(text + quad("Last"), many);
    EXPECT_EQ(few.count("many-casters"), 0u);
    EXPECT_EQ(many.count("many-casters"), 1u);
    EXPECT_EQ(many.scene.casters.list.size(), 65u);
}

TEST(Casters, BeyondAThousandAreTheRest) {
    std::string text;
    for (int i = 0; i < 1030; ++i) text += quad(fmt::format("Q{:04}", i));
    Translated out;
    const std::string names =
        casters_of(text + quad("Same", "string velatura:shadow:caster = \"last\"") +
                       quad("Then", "string velatura:shadow:caster = \"last\""),
                   out);
    EXPECT_EQ(out.scene.casters.list.size(), 1024u);
    EXPECT_NE(names.find("/Q1023 - - - - - - - - "), std::string::npos);
    EXPECT_EQ(out.count("many-casters"), 1u);
}

TEST(Casters, AreNotLookedForWhenNobodyAsks) {
    Translated out;
    translate_text(quad("Wall", "string velatura:shadow:caster = \"walls\"") + camera(), out);
    EXPECT_TRUE(out.scene.casters.list.empty());
    EXPECT_TRUE(out.scene.casters.shapes.empty());
}

}  // namespace velatura::translate::linking
