// SPDX-License-Identifier: Apache-2.0
// Opinions from the command line: --session, --variant and --set give the stage that a wrapper
// layer with the same opinions gives, and what does not fit the scene is refused with the option.
#include "command.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace velatura::test {

namespace {

constexpr const char* scene = R"usda(#usda 1.0
(
    upAxis = "Y"
    startTimeCode = 3
)
def Xform "W" (
    variants = { string size = "small" }
    prepend variantSets = "size"
)
{
    def SphereLight "key"
    {
        float inputs:intensity = 4
        color3f inputs:color = (1, 1, 1)
    }
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        color3f[] primvars:displayColor = [(1, 0, 0)]
        rel material:binding = </W/Old>
    }
    def Material "Old" {
    }
    def Material "New" {
        color3f inputs:tint = (1, 1, 1)
        color3f inputs:other = (0, 1, 1)
        asset inputs:file = @a.png@
    }
    def Xform "Copy" (
        instanceable = true
        references = </Source>
    )
    {
    }
    variantSet "size" = {
        "small" {
            over "Ball" {
                double radius = 1
            }
        }
        "large" {
            over "Ball" {
                double radius = 7
            }
        }
    }
}
def Xform "Source"
{
    def Sphere "Inner" {
    }
}
)usda";

class SceneOverrides : public ::testing::Test {
  protected:
    void SetUp() override {
        w.write("s.usda", scene);
        w.write("look.usda",
                "#usda 1.0\n(\n    upAxis = \"Z\"\n)\nover \"W\" {\n    over \"key\" {\n        "
                "float inputs:intensity = 9\n        float inputs:exposure = 2\n    }\n}\n");
    }

    /// Every fact of the composed stage with these options, but for the lines that name layers.
    std::string facts(const std::string& arguments) {
        const CommandResult r = w.velatura("info --dump " + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        std::istringstream in(r.output);
        std::string kept;
        for (std::string line; std::getline(in, line);)
            if (line.find(" spec ") == std::string::npos) kept += line + "\n";
        return kept;
    }

    /// The same of a layer with these opinions above the scene.
    std::string facts_above(const std::string& opinions, const std::string& layers = "") {
        w.write("above.usda", "#usda 1.0\n(\n    subLayers = [" + layers +
                                  "@s.usda@]\n    upAxis = \"Y\"\n    startTimeCode = 3\n)\n" +
                                  opinions);
        return facts("above.usda");
    }

    Workplace w;
};

}  // namespace

TEST_F(SceneOverrides, GiveTheStageOfALayerAboveTheScene) {
    const struct {
        const char* options;
        const char* opinions;
    } cases[] = {
        {"--set /W/key.inputs:intensity=2.5",
         "over \"W\" { over \"key\" {\n float inputs:intensity = 2.5\n}\n}\n"},
        {"--set '/W/key.inputs:color=(1, 0.5, 0)'",
         "over \"W\" { over \"key\" {\n color3f inputs:color = (1, 0.5, 0)\n}\n}\n"},
        // From the schema; quotes may be left out
        {"--set /W/Ball.visibility=invisible",
         "over \"W\" { over \"Ball\" {\n token visibility = \"invisible\"\n}\n}\n"},
        {"--set '/W/Ball.primvars:displayColor=[(0, 0, 1), (0, 1, 0)]'",
         "over \"W\" { over \"Ball\" {\n color3f[] primvars:displayColor = [(0, 0, 1), (0, 1, "
         "0)]\n}\n}\n"},
        {"--set /W/New.inputs:file=b.png",
         "over \"W\" { over \"New\" {\n asset inputs:file = @b.png@\n}\n}\n"},
        {"--set '/W/New.inputs:tint.connect=</W/New.inputs:other>'",
         "over \"W\" { over \"New\" {\n color3f inputs:tint.connect = "
         "</W/New.inputs:other>\n}\n}\n"},
        {"--set '/W/Ball.material:binding=<../New>'",
         "over \"W\" { over \"Ball\" {\n rel material:binding = </W/New>\n}\n}\n"},
        {"--set '/W/key.inputs:intensity=None'",
         "over \"W\" { over \"key\" {\n float inputs:intensity = None\n}\n}\n"},
        // A new one brings its type, and metadata if need be
        {"--set 'float /W/Ball.primvars:wear=0.5 (interpolation = \"constant\")'",
         "over \"W\" { over \"Ball\" {\n float primvars:wear = 0.5 (interpolation = "
         "\"constant\")\n}\n}\n"},
        // The last one counts
        {"--set /W/key.inputs:intensity=1 --set /W/key.inputs:intensity=2",
         "over \"W\" { over \"key\" {\n float inputs:intensity = 2\n}\n}\n"},
        {"--variant '/W{size=large}'",
         "over \"W\" (variants = { string size = \"large\" }) {\n}\n"},
        {"--variant '/W{size=large}' --set /W/Ball.radius=3",
         "over \"W\" (variants = { string size = \"large\" }) { over \"Ball\" {\n double radius = "
         "3\n}\n}\n"},
    };

    for (const auto& c : cases)
        EXPECT_EQ(facts(std::string("s.usda ") + c.options), facts_above(c.opinions)) << c.options;
}

TEST_F(SceneOverrides, StandInOrderAndBringTheMetadataOfTheSession) {
    const std::string session = facts("s.usda --session look.usda");
    EXPECT_NE(session.find("/W/key.inputs:intensity default = 9"), std::string::npos) << session;
    EXPECT_NE(session.find("upAxis = \"Z\""), std::string::npos) << session;
    EXPECT_NE(session.find("/W/key.inputs:exposure default = 2"), std::string::npos) << session;
    // --set above --session, of which the rest stays
    std::string expected = session;
    const size_t at = expected.find("/W/key.inputs:intensity default = 9");
    expected.replace(at, std::string("/W/key.inputs:intensity default = 9").size(),
                     "/W/key.inputs:intensity default = 5");
    EXPECT_EQ(facts("s.usda --set /W/key.inputs:intensity=5 --session look.usda"), expected);
    // What flatten writes has them, too
    EXPECT_NE(w.velatura("flatten s.usda --set /W/Ball.radius=5").output.find("double radius = 5"),
              std::string::npos);
    const CommandResult why = w.velatura(
        "info s.usda --explain /W/Ball.radius --set "
        "/W/Ball.radius=5");
    EXPECT_NE(why.output.find("--set /W/Ball.radius=5: default = 5"), std::string::npos)
        << why.output;
}

/// Of several session layers the last one is the strongest, as of other repeated options; each is
/// a session layer of its own, so that one without a rate has the stage's (48 here), not 24:
/// sample 10 of `late` stands at time 10. Metadata: the strongest that says it, the root layer
/// else; startTimeCode of a session layer decides which frame is rendered, as in OpenUSD.
TEST_F(SceneOverrides, SessionsStackAndKeepTheStage) {
    w.write("r.usda",
            "#usda 1.0\n(\n    upAxis = \"Z\"\n    metersPerUnit = 1\n    "
            "timeCodesPerSecond = 48\n    startTimeCode = 3\n    endTimeCode = 9\n    "
            "renderSettingsPrimPath = \"/Render/S\"\n)\ndef Sphere \"B\" {\n    double "
            "radius = 1\n}\n");
    w.write("early.usda",
            "#usda 1.0\n(\n    startTimeCode = 5\n)\nover \"B\" {\n    double radius = 2\n    "
            "double extra = 4\n}\n");
    w.write("late.usda", "#usda 1.0\nover \"B\" {\n    double radius.timeSamples = { 10: 6 }\n}\n");
    const std::string root = facts("r.usda"),
                      both = facts("r.usda --session early.usda --session late.usda"),
                      with_set = facts(
                          "r.usda --session early.usda --session late.usda --set /B.radius=8");
    for (const std::string& text : {both, with_set}) {
        for (const char* kept : {"upAxis = \"Z\"", "metersPerUnit = 1", "timeCodesPerSecond = 48",
                                 "endTimeCode = 9", "renderSettingsPrimPath = \"/Render/S\"",
                                 "startTimeCode = 5", "/B.extra default = 4"})
            EXPECT_NE(text.find(kept), std::string::npos) << kept << "\n" << text;
    }
    EXPECT_NE(root.find("startTimeCode = 3"), std::string::npos) << root;
    EXPECT_NE(both.find("/B.radius ts 10 = 6"), std::string::npos) << both;
    EXPECT_NE(with_set.find("/B.radius default = 8"), std::string::npos) << with_set;
    // The other way round the radius of `early` hides the sample
    const CommandResult why = w.velatura(
        "info r.usda --explain /B.radius --session late.usda --session early.usda --time 10");
    EXPECT_NE(why.output.find("= 2\n"), std::string::npos) << why.output;

    // Which frame a plain render takes; a file that is read is not written over
    const std::string render = "render r.usda --res 8 8 --spp 1 --progress none -o ";
    EXPECT_EQ(w.velatura(render + "'f.####.exr' --session early.usda").exit_code, 0);
    EXPECT_TRUE(w.exists("f.0005.exr")) << w.files_beside("");
    EXPECT_EQ(w.velatura("flatten r.usda --session early.usda -o early.usda").exit_code, 2);
}

/// Relative asset paths of --set start at the folder that the program runs in, those of a session
/// layer at its own: a layer in another folder that names the same file writes the way back.
TEST_F(SceneOverrides, AssetPathsStartWhereTheyWereSaid) {
    ASSERT_EQ(w.velatura("flatten s.usda -o sub/deep/s.usda").exit_code, 0);
    w.write("sub/look.usda",
            "#usda 1.0\nover \"W\" { over \"New\" {\n asset inputs:file = @./look.png@\n}\n}\n");

    const struct {
        const char* options;
        const char* path;
    } cases[] = {
        {"--set /W/New.inputs:file=./set.png", "@../../set.png@"},
        {"--set /W/New.inputs:file=@./set.png@", "@../../set.png@"},
        {"--session sub/look.usda", "@../look.png@"},
        {"--session sub/look.usda --set /W/New.inputs:file=./set.png", "@../../set.png@"},
    };

    for (const auto& c : cases) {
        EXPECT_EQ(
            w.velatura("flatten sub/deep/s.usda -o sub/deep/flat.usda " + std::string(c.options))
                .exit_code,
            0);
        const CommandResult flat = w.velatura("flatten --layer sub/deep/flat.usda");
        EXPECT_NE(flat.output.find(c.path), std::string::npos) << c.options << flat.output;
    }
}

/// A connection is stronger than a value: said, with how to remove it, where the other end has
/// something to give.
TEST_F(SceneOverrides, AValueBelowAConnectionIsSaid) {
    w.write("c.usda", R"usda(#usda 1.0
def Material "M"
{
    color3f inputs:tint = (0, 1, 0)
    color3f inputs:empty
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 1, 1)
        color3f inputs:diffuseColor.connect = </M.inputs:tint>
        float inputs:roughness.connect = </M/T.outputs:r>
        color3f inputs:emissiveColor.connect = </M.inputs:empty>
        float inputs:metallic.connect = </M/Nowhere.outputs:r>
        token outputs:surface
    }
    def Shader "T"
    {
        uniform token info:id = "UsdUVTexture"
        float outputs:r
    }
}
)usda");

    const struct {
        const char* options;
        const char* warning;  ///< empty: none
    } cases[] = {
        {"--set '/M/S.inputs:diffuseColor=(1, 0, 0)'",
         "--set /M/S.inputs:diffuseColor=(1, 0, 0): warning: the value has no effect, because "
         "inputs:diffuseColor is connected to </M.inputs:tint>; remove the connection with --set "
         "'/M/S.inputs:diffuseColor.connect=None'"},
        {"--set /M/S.inputs:roughness=0.2", "is connected to </M/T.outputs:r>"},
        {"--set '/M/S.inputs:emissiveColor=(1, 1, 1)'", ""},
        {"--set /M/S.inputs:metallic=1", ""},
        {"--set /M/S.inputs:opacity=0.5", ""},
        {"--set '/M.inputs:tint=(1, 0, 0)'", ""},
        {"--set '/M/S.inputs:diffuseColor=(1, 0, 0)' --set /M/S.inputs:diffuseColor.connect=None",
         ""},
    };

    for (const auto& c : cases) {
        const CommandResult r = w.velatura(std::string("info --tree c.usda ") + c.options);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        if (*c.warning) {
            EXPECT_NE(r.output.find(c.warning), std::string::npos) << c.options << r.output;
        } else {
            EXPECT_EQ(r.output.find("set-connected"), std::string::npos) << c.options << r.output;
        }
    }
    // Without the connection the value counts
    const CommandResult why = w.velatura(
        "flatten c.usda --set '/M/S.inputs:diffuseColor=(1, 0, 0)' --set "
        "/M/S.inputs:diffuseColor.connect=None");
    EXPECT_EQ(why.output.find("diffuseColor.connect = <"), std::string::npos) << why.output;
}

/// A line for each kind of mistake: options, part of the message, exit code.
TEST_F(SceneOverrides, WhatDoesNotFitIsRefusedWithTheOption) {
    const struct {
        const char* options;
        const char* message;
        int exit_code;
    } cases[] = {
        {"--set /W/key.inputs:intensity", "expected /Prim.attribute=value", 2},
        {"--set inputs:intensity=3", "expected /Prim.attribute=value", 2},
        {"--set /W/key=3", "\"/W/key\" is not an attribute path", 2},
        {"--set /W/key.inputs:intensity=", "missing value after '='", 2},
        {"--set '/W{size=large}Ball.radius=3'", "found the end at character 8", 2},
        {"--set '/W/k ey.radius=3'", "--set", 2},
        {"--set /W/kye.inputs:intensity=3",
         "--set /W/kye.inputs:intensity=3: prim </W/kye> not found (did you mean 'key'?)", 2},
        {"--set /World/key.inputs:intensity=3", "prim </World> not found", 2},
        {"--set /W/key.inputs:intensty=3",
         "</W/key> has no attribute inputs:intensty (did you mean 'inputs:intensity'?); a new one "
         "needs a type: --set 'float /W/key.inputs:intensty=3'",
         2},
        {"--set /W/key.velatura:light:group=warm",
         "</W/key> has no attribute velatura:light:group; a new one needs a type: --set 'token "
         "/W/key.velatura:light:group=warm'",
         2},
        {"--set /W/key.inputs:intensity=bright",
         "--set /W/key.inputs:intensity=bright: cannot read the value of type float, character 1",
         2},
        {"--set '/W/key.inputs:color=(1, 2)'", "cannot read the value of type color3f", 2},
        {"--set '/W/key.inputs:color=(1, 2, 3'", "cannot read the value of type color3f", 2},
        {"--set 'flot /W/Ball.x=3'", "found unknown type 'flot' of attribute 'x'", 2},
        {"--set '/W/Ball.radius=3\n}\ndef Sphere \"More\" {'", "--set", 2},
        {"--set '/W/Ball.radius=3\nfloat b = 2'", "expected one value, found more", 2},
        {"--set /W/Copy/Inner.radius=3",
         "</W/Copy/Inner> is inside the instance </W/Copy>, where opinions are ignored", 2},
        {"--variant /W", "expected /Prim{set=name}", 2},
        {"--variant '/W{size=large}Ball'", "expected /Prim{set=name}", 2},
        {"--variant '/W{size=huge}'", "the set has no variant huge: expected large, small", 2},
        {"--variant '/W{sise=large}'", "</W> has no variant set sise: it has size", 2},
        {"--variant '/W/Ball{size=large}'", "</W/Ball> has no variant set size: it has none", 2},
        {"--variant '/V{size=large}'", "prim </V> not found", 2},
        {"--session none.usda", "--session none.usda: file not found", 2},
        {"--session bad.usda", "bad.usda:2:", 1},
    };

    w.write("bad.usda", "#usda 1.0\ndef {\n");
    for (const auto& c : cases) {
        const CommandResult r = w.velatura(std::string("info s.usda ") + c.options);
        EXPECT_EQ(r.exit_code, c.exit_code) << c.options << ": " << r.output;
        EXPECT_NE(r.output.find(c.message), std::string::npos) << c.options << ": " << r.output;
    }
    for (const char* command : {"render -o x.exr s.usda", "plan s.usda", "flatten s.usda"})
        EXPECT_EQ(w.velatura(std::string(command) + " --set /W/kye.inputs:intensity=3").exit_code,
                  2)
            << command;
    for (const char* option :
         {"--set /W/Ball.radius=3", "--session look.usda", "--variant '/W{size=large}'"}) {
        const CommandResult r = w.velatura(std::string("flatten --layer s.usda ") + option);
        EXPECT_EQ(r.exit_code, 2) << r.output;
        EXPECT_NE(r.output.find("--layer converts one layer without composition"),
                  std::string::npos)
            << r.output;
    }
    EXPECT_EQ(w.files_beside("s.usda look.usda bad.usda above.usda"), "");
}

/// They are a part of the scene: pixels are those of the scene that says the same, and a render
/// with others is another one.
TEST_F(SceneOverrides, ArePartOfTheSceneOfAFile) {
    w.write("s.usda", small_scene());
    std::string brighter = small_scene();
    brighter.replace(brighter.find("inputs:intensity = 8"), 20, "inputs:intensity = 3");
    w.write("t.usda", brighter);
    const std::string render = "render --res 24 18 --spp 4 --progress none -q ";
    EXPECT_EQ(w.velatura(render + "t.usda -o t.exr").exit_code, 0);
    EXPECT_EQ(w.velatura(render + "s.usda -o plain.exr").exit_code, 0);
    const std::string set = " --set /W/key.inputs:intensity=3 ";
    EXPECT_EQ(w.velatura(render + "s.usda --resumable -o s.exr" + set).exit_code, 0);
    EXPECT_EQ(w.hash("s.exr"), w.hash("t.exr"));
    EXPECT_NE(w.hash("s.exr"), w.hash("plain.exr"));
    const std::string resume =
        "render --res 24 18 --spp 8 --progress none -q s.usda --resume -o "
        "s.exr ";

    const struct {
        const char* option;
        const char* has;
    } others[] = {{"", "nothing"},
                  {"--set /W/key.inputs:intensity=2", "--set /W/key.inputs:intensity=2"}};

    for (const auto& other : others) {
        const CommandResult r = w.velatura(resume + other.option);
        EXPECT_EQ(r.exit_code, 5) << r.output;
        EXPECT_NE(r.output.find(std::string("the scene's layers have changed: it had --set "
                                            "/W/key.inputs:intensity=3, now ") +
                                other.has),
                  std::string::npos)
            << r.output;
    }
    EXPECT_EQ(w.velatura(resume + set).exit_code, 0);

    // Parts of different scenes do not merge, and the setting is named
    const std::string part = "render s.usda --res 24 18 --progress none -q --samples ";
    EXPECT_EQ(w.velatura(part + "0:2 -o a.exr --set /W/key.inputs:intensity=3").exit_code, 0);
    EXPECT_EQ(w.velatura(part + "2:4 -o b.exr --set /W/key.inputs:intensity=2").exit_code, 0);
    const CommandResult merged = w.comp("merge a.exr b.exr -o m.exr");
    EXPECT_EQ(merged.exit_code, 5) << merged.output;
    EXPECT_NE(merged.output.find("a.exr and b.exr show different scenes: --set "
                                 "/W/key.inputs:intensity=3 in the first, --set "
                                 "/W/key.inputs:intensity=2 in the second"),
              std::string::npos)
        << merged.output;
    EXPECT_FALSE(w.exists("m.exr"));

    // The layer that bake writes needs no wrapper: halving what is 3 gives 1.5
    EXPECT_EQ(w.comp("bake t.exr --gain key=0.5 -o look.usda").exit_code, 0);
    EXPECT_EQ(w.velatura(render + "t.usda --session look.usda -o baked.exr").exit_code, 0);
    EXPECT_EQ(w.velatura(render + "t.usda --set /W/key.inputs:intensity=1.5 -o set.exr").exit_code,
              0);
    EXPECT_EQ(w.hash("baked.exr"), w.hash("set.exr"));
}

}  // namespace velatura::test
