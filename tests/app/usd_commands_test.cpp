// SPDX-License-Identifier: Apache-2.0
// `info --explain`, `flatten` and `import` from the outside: what they print and leave behind.
#include "command.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::test {
namespace {

const char* const five_arcs = R"(#usda 1.0
(
    subLayers = [@sub.usda@]
)
class "_class_Lamp"
{
    double size = 1
}
def Cube "Lamp" (
    inherits = </_class_Lamp>
    references = @ref.usda@</Ref>
    payload = @pay.usda@</Pay>
    variants = { string look = "big" }
    prepend variantSets = "look"
)
{
    variantSet "look" = {
        "big" {
            double size = 3
        }
    }
}
)";

void write_five_arcs(const Workplace& place) {
    place.write("root.usda", five_arcs);
    place.write("sub.usda", "#usda 1.0\nover \"Lamp\"\n{\n    double size = 2\n}\n");
    place.write("ref.usda", "#usda 1.0\ndef Cube \"Ref\"\n{\n    double size = 4\n}\n");
    place.write("pay.usda", "#usda 1.0\ndef Cube \"Pay\"\n{\n    double size = 5\n}\n");
}

/// Facts of a dump but for the lines that name layer files.
std::string facts(const Workplace& place, const std::string& scene) {
    const std::string dump = place.velatura("info --dump " + scene).output;
    std::string kept;
    size_t begin = 0;
    while (begin < dump.size()) {
        const size_t end = dump.find('\n', begin);
        const std::string line = dump.substr(begin, end - begin);
        if (line.find(" spec ") == std::string::npos) kept += line + "\n";
        if (end == std::string::npos) break;
        begin = end + 1;
    }
    return kept;
}

TEST(UsdCommands, ExplainListsEveryOpinionStrongestFirstWithItsPlace) {
    const Workplace place;
    write_five_arcs(place);
    const CommandResult result = place.velatura("info root.usda --explain /Lamp.size");
    EXPECT_EQ(result.exit_code, 0);
    size_t at = 0;
    for (const char* opinion :
         {"sub.usda:4:", "default = 2", "root.usda:7:", "default = 1",
          "inherit </_class_Lamp.size>", "root.usda:19:", "default = 3",
          "variant </Lamp{look=big}.size>", "ref.usda:4:", "default = 4", "reference </Ref.size>",
          "pay.usda:4:", "default = 5", "payload </Pay.size>", "fallback = 2"}) {
        const size_t found = result.output.find(opinion, at);
        ASSERT_NE(found, std::string::npos) << opinion << " in\n" << result.output;
        at = found;
    }
    EXPECT_NE(place.velatura("info root.usda --explain /Nope.size").exit_code, 0);
}

TEST(UsdCommands, FlattenKeepsEveryFactAsTextAndAsCrate) {
    const Workplace place;
    write_five_arcs(place);
    EXPECT_EQ(place.velatura("flatten root.usda -o flat.usda").exit_code, 0);
    EXPECT_EQ(place.velatura("flatten root.usda -o flat.usdc").exit_code, 0);
    const std::string expected = facts(place, "root.usda");
    EXPECT_NE(expected.find("/Lamp.size default = 2"), std::string::npos) << expected;
    EXPECT_EQ(facts(place, "flat.usda"), expected);
    EXPECT_EQ(facts(place, "flat.usdc"), expected);
}

TEST(UsdCommands, FlattenLayerPrintsTheLayerAsItStands) {
    const Workplace place;
    write_five_arcs(place);
    const CommandResult result = place.velatura("flatten --layer root.usda");
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.output.find("references = @ref.usda@</Ref>"), std::string::npos)
        << result.output;
    EXPECT_EQ(result.output.find("double size = 4"), std::string::npos);
}

TEST(UsdCommands, FlattenThatFailsLeavesNothing) {
    const Workplace place;
    write_five_arcs(place);
    const std::string before = "pay.usda ref.usda root.usda sub.usda";
    EXPECT_EQ(place.velatura("flatten missing.usda -o flat.usda").exit_code, 1);
    EXPECT_EQ(place.velatura("flatten root.usda -o ref.usda/flat.usda").exit_code, 1);
    EXPECT_EQ(place.files_beside(before), "");
}

TEST(UsdCommands, FlattenNamesThePrimThatNoCrateCanHold) {
    const Workplace place;
    place.write("zero.usda", "#usda 1.0\ndef \"A\"\n{\n    string s = \"a\\x00b\"\n}\n");
    const CommandResult result = place.velatura("flatten zero.usda -o zero.usdc");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.output.find("</A.s>"), std::string::npos) << result.output;
    EXPECT_EQ(place.files_beside("zero.usda"), "");
}

TEST(UsdCommands, NamesAndOptionsThatDoNotFitAreUsageErrors) {
    const Workplace place;
    write_five_arcs(place);
    for (const char* arguments :
         {"flatten root.usda -o x.usdz", "flatten root.usda -o x.foo",
          "flatten --usdc root.usda -o x.usda", "info root.usda --dump --tree",
          "info root.usda --explain ''", "info root.usda --time 3",
          "info root.usda --explain /Lamp.size --time nan"}) {
        EXPECT_EQ(place.velatura(arguments).exit_code, 2) << arguments;
    }
    EXPECT_EQ(place.files_beside("pay.usda ref.usda root.usda sub.usda"), "");
}

TEST(UsdCommands, ImportWritesAStageThatOpens) {
    const Workplace place;
    place.write("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    EXPECT_EQ(place.velatura("import tri.obj -o tri.usda").exit_code, 0);
    const CommandResult dump = place.velatura("info --dump tri.usda");
    EXPECT_EQ(dump.exit_code, 0);
    EXPECT_NE(dump.output.find("faceVertexCounts default = [3]"), std::string::npos) << dump.output;
}

TEST(UsdCommands, ImportOfBrokenFilesSaysSoAndLeavesNothing) {
    const Workplace place;
    place.write("broken.gltf", "{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [ { ");
    place.write("broken.fbx", std::string("Kaydara FBX Binary  \0\x1a\0", 23) + "garbage");
    for (const char* file : {"broken.gltf", "broken.fbx", "missing.dae"}) {
        const CommandResult result = place.velatura("import " + std::string(file) + " -o out.usda");
        EXPECT_EQ(result.exit_code, 1) << file;
        EXPECT_NE(result.output.find("error"), std::string::npos) << result.output;
    }
    EXPECT_EQ(place.files_beside("broken.fbx broken.gltf"), "");
}

}  // namespace
}  // namespace velatura::test
