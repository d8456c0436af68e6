// SPDX-License-Identifier: Apache-2.0
// Where the scene leaves something open, one line says what was taken and how to choose; where the
// layers come to more than other programs open, one says what to leave out.
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace velatura::test {

namespace {

constexpr const char* ball = "def Sphere \"Ball\" {\n}\n";
constexpr const char* sky = "def DomeLight \"Sky\" {\n}\n";

std::string camera(const std::string& name) {
    return "def Camera \"" + name +
           "\" {\n double3 xformOp:translate = (0, 0, 9)\n uniform token[] xformOpOrder = "
           "[\"xformOp:translate\"]\n}\n";
}

std::string settings(const std::string& metadata) {
    return "#usda 1.0\n(" + metadata +
           ")\ndef Scope \"Render\" {\n def RenderSettings \"S\" {\n  uniform int2 resolution = "
           "(8, "
           "6)\n }\n}\n";
}

std::string pane(const std::string& name) {
    return "def Mesh \"" + name +
           "\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n int[] faceVertexCounts = [4]\n "
           "int[] faceVertexIndices = [0, 1, 2, 3]\n point3f[] points = [(0, 0, 0), (1, 0, 0), (1, "
           "1, 0), (0, 1, 0)]\n uniform token subdivisionScheme = \"none\"\n rel material:binding "
           "= "
           "</Clear>\n}\n";
}

constexpr const char* clear_material =
    "def Material \"Clear\" {\n token outputs:surface.connect = </Clear/P.outputs:surface>\n def "
    "Shader \"P\" {\n  uniform token info:id = \"UsdPreviewSurface\"\n  float inputs:opacity = "
    "0.2\n  token outputs:surface\n }\n}\n";

size_t count_of(const std::string& text, const std::string& part) {
    size_t count = 0;
    for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
    return count;
}

int number_before(const std::string& text, const std::string& word) {
    const size_t end = text.find(word);
    if (end == std::string::npos) return -1;
    const size_t begin = text.find_last_not_of("0123456789", end - 1) + 1;
    return std::atoi(text.substr(begin, end - begin).c_str());
}

}  // namespace

TEST(Choices, AreSaidOnce) {
    const std::string plain = "#usda 1.0\n";
    const std::string named = settings("renderSettingsPrimPath = \"/Render/S\"");

    const struct {
        std::string scene;
        const char* code;
        const char* line;  ///< nothing: the scene leaves nothing open
    } cases[] = {
        {plain + ball + sky, "[framing-camera]",
         "note: the stage has no camera; using one that frames the scene"},
        {plain + ball + sky + camera("A") + camera("B") + camera("C"), "[camera-chosen]",
         "note: no camera chosen; using the first of 3: </A>; --camera chooses </B>, </C>"},
        {named + ball + sky + camera("A"), "[camera-chosen]", nullptr},
        {plain + ball + sky + camera("A"), "[no-render-settings]",
         "note: the stage has no RenderSettings: 8 x 6 pixels and the other defaults are used"},
        {settings("") + ball + sky + camera("A"), "[no-render-settings]",
         "note: renderSettingsPrimPath is not set; choose with --settings /Render/S: 8 x 6 "
         "pixels"},
        {named + ball + sky + camera("A"), "[no-render-settings]", nullptr},
        {named + ball + camera("A"), "[no-lights]",
         "the stage has no light; a white dome of radiance 1 is added"},
        {named + ball + sky + camera("A"), "[no-lights]", nullptr},
        {named + pane("P") + clear_material + sky + camera("A"), "[thin-walls]",
         "note: 1 mesh is taken as a thin wall"},
        {named + pane("P") + pane("Q") + clear_material + sky + camera("A"), "[thin-walls]",
         "note: 2 meshes are taken as thin walls"},
        {named + ball + clear_material + sky + camera("A"), "[thin-walls]", nullptr},
    };

    const Workplace w;
    for (const auto& c : cases) {
        w.write("s.usda", c.scene);
        for (const char* command :
             {"render s.usda --frames 1-3 -o s.####.exr --spp 1 --layers none --guiding off "
              "--splitting off --progress none --res 8 6",
              "plan s.usda --res 8 6"}) {
            const std::string said = w.velatura(command).output;
            EXPECT_EQ(count_of(said, c.code), c.line ? 1u : 0u) << c.code << " in " << said;
            if (c.line) {
                EXPECT_EQ(count_of(said, c.line), 1u) << c.line << " in " << said;
            }
        }
        EXPECT_EQ(count_of(w.velatura("plan s.usda --res 8 6 -q").output, c.code), 0u);
    }
}

TEST(Choices, OfInfoAreThoseOfARender) {
    const Workplace w;
    w.write("s.usda", std::string("#usda 1.0\n") + ball + camera("A") + camera("B"));
    const std::string said = w.velatura("info s.usda").output;
    for (const char* line :
         {"using the first of 2: </A>; --camera chooses </B>", "the stage has no RenderSettings",
          "unless a material emits, a white dome of radiance 1 is added"})
        EXPECT_EQ(count_of(said, line), 1u) << line << " in " << said;
    w.write(
        "m.usda",
        "#usda 1.0\ndef Material \"Full\" {\n}\ndef Material \"Rough\" {\n}\ndef Sphere \"Ball\" "
        "(prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n rel material:binding:full = "
        "</Full>\n rel material:binding:preview = </Rough>\n}\n");

    const struct {
        const char* options;
        const char* line;
    } cases[] = {{"--tree", "Ball (Sphere)\n"},
                 {"--tree --material-purpose full", "Ball (Sphere) -> /Full\n"},
                 {"--tree --material-purpose preview", "Ball (Sphere) -> /Rough\n"},
                 {"--tree --material-purpose allPurpose", "Ball (Sphere) -> no material\n"}};

    for (const auto& c : cases) {
        const std::string tree = w.velatura(std::string("info m.usda ") + c.options).output;
        EXPECT_NE(tree.find(c.line), std::string::npos) << c.options << ": " << tree;
    }
    EXPECT_EQ(w.velatura("info m.usda --material-purpose full").exit_code, 2);
}

/// The count is the plan's, and what is said to be saved is what a plan without it has less.
TEST(Choices, TooManyChannelsAreWarnedOfWithWhatToLeaveOut) {
    const Workplace w;
    std::string scene = std::string("#usda 1.0\n") + ball + camera("A");
    for (int i = 0; i < 8; ++i)
        scene += fmt::format("def SphereLight \"L{}\" {{\n float inputs:radius = 0.1\n}}\n", i);
    for (int i = 0; i < 10; ++i) scene += fmt::format("def Cube \"C{}\" {{\n}}\n", i);
    w.write("s.usda", scene);
    const std::string plan = "plan s.usda --res 8 6 --cryptomatte object ";
    const auto channels = [&](const std::string& options) {
        return number_before(w.velatura(plan + options).output, " channels, at most");
    };
    const std::string all = "--halves --layers bounce,light,matrix,shadow,caster,data";
    const std::string said = w.velatura(plan + all).output;
    const int count = channels(all);
    EXPECT_GT(count, 1023);
    EXPECT_EQ(count_of(said, "[many-channels]"), 1u) << said;
    EXPECT_NE(said.find(fmt::format(
                  "the file has up to {} channels, above Nuke's maximum of 1023; ", count)),
              std::string::npos)
        << said;

    const struct {
        const char* what;
        const char* options;
    } savings[] = {
        {" --halves", "--layers bounce,light,matrix,shadow,caster,data"},
        {" caster of --layers", "--halves --layers bounce,light,matrix,shadow,data"},
        {" matrix of --layers", "--halves --layers bounce,light,shadow,caster,data"},
        {" bounces past", "--halves --layers bounce,light,matrix,shadow,caster,data --bounces 2"},
    };

    const std::string list = said.substr(said.find("the file has up to"));
    for (const auto& s : savings)
        EXPECT_EQ(number_before(list, s.what), count - channels(s.options))
            << s.what << ": " << said;
    // A render says so before its first sample, once for all frames
    EXPECT_EQ(count_of(w.velatura("render s.usda --res 2 2 --spp 1 --guiding off --splitting off "
                                  "--frames 1-2 --progress none -o x.exr " +
                                  all)
                           .output,
                       "[many-channels]"),
              1u);
    EXPECT_EQ(count_of(w.velatura("plan s.usda --res 8 6").output, "[many-channels]"), 0u);
}

}  // namespace velatura::test
