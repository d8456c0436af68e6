// SPDX-License-Identifier: Apache-2.0
// The effect plan from the outside: `velatura plan`, `--effects`, header and statistics.
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <iterator>
#include <string>

namespace velatura::test {
namespace {

using nlohmann::json;

/// small_scene() with a coated wall and a lamp that emits nothing.
std::string scene_with_effects() {
    return small_scene() + R"usda(
def Mesh "Coated" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-0.8, 0.2, -1), (0.8, 0.2, -1), (0.8, 1.5, -1), (-0.8, 1.5, -1)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Coat>
}
def Material "Coat"
{
    token outputs:surface.connect = </Coat/P.outputs:surface>
    def Shader "P"
    {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:clearcoat = 1
        float inputs:opacity = 1
        token outputs:surface
    }
}
)usda";
}

class EffectsCommand : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", scene_with_effects()); }

    CommandResult render(const std::string& arguments) {
        return w.velatura("render s.usda --res 40 34 --spp 4 --progress none -q " + arguments);
    }

    json header_plan(const std::string& file) const {
        const Result<image::Image> image = image::read_exr(w.path(file));
        EXPECT_TRUE(image.has_value());
        const std::string text = image ? image->text(layers::plan_attribute) : std::string();
        EXPECT_FALSE(text.empty());
        return text.empty() ? json() : json::parse(text);
    }

    static json entry(const json& effects, const std::string& name) {
        for (const json& e : effects)
            if (e["name"] == name) return e;
        return {};
    }

    Workplace w;
};

TEST_F(EffectsCommand, PlanSaysWhoCallsForWhat) {
    const CommandResult r = w.velatura("plan s.usda");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find(" on   clearcoat            </Coat>: clearcoat 1\n"), std::string::npos)
        << r.output;
    EXPECT_NE(r.output.find(" off  transmission         proven zero: </Coat/P>"), std::string::npos)
        << r.output;
    EXPECT_NE(r.output.find("absent: "), std::string::npos);
    EXPECT_EQ(w.files_beside("s.usda"), "") << "a plan writes nothing";
}

TEST_F(EffectsCommand, PlanAsJsonIsThatOfTheHeader) {
    const CommandResult planned = w.velatura("plan s.usda --json -q --spp 4 --res 40 34");
    ASSERT_EQ(planned.exit_code, 0) << planned.output;
    ASSERT_EQ(render("-o a.exr").exit_code, 0);
    const json in_plan = json::parse(planned.output), in_header = header_plan("a.exr");
    EXPECT_EQ(in_plan["effects"], in_header["effects"]);
    EXPECT_FALSE(in_header.contains("ran_though_off"));
}

TEST_F(EffectsCommand, StatisticsCountCalls) {
    ASSERT_EQ(render("-o a.exr --stats a.json").exit_code, 0);
    std::ifstream in(w.path("a.json"));
    const json effects = json::parse(in)["effects"];
    EXPECT_GT(entry(effects, "clearcoat")["calls"], 0);
    EXPECT_EQ(entry(effects, "transmission")["calls"], 0);
    EXPECT_EQ(entry(effects, "transmission")["state"], "proven zero");
}

/// The memory that is told beforehand is what a render has, within the spread that counts and black
/// layers make.
TEST_F(EffectsCommand, PlanTellsTheMemory) {
    const json needs = json::parse(
        w.velatura("plan s.usda --json -q --res 128 96").output)["needs"]["memory_bytes"];
    ASSERT_EQ(
        w.velatura("render s.usda -o a.exr --res 128 96 --spp 16 --progress none -q --stats a.json")
            .exit_code,
        0);
    std::ifstream in(w.path("a.json"));
    const json memory = json::parse(in)["memory_bytes"];
    EXPECT_EQ(needs["geometry"], memory["geometry"]);
    const double film = double(memory["film"]) / double(needs["film_expected"]);
    EXPECT_GT(film, 0.3);
    EXPECT_LT(film, 2.0);
}

/// No file is larger than was told, and one of which every layer is lit is not much smaller.
TEST_F(EffectsCommand, PlanTellsTheFile) {
    w.write("corner.usda", small_scene());
    const std::string common = "corner.usda --res 24 20 --bounces 2 -o a.exr -q ";
    for (const char* layers :
         {"", "--halves", "--layers caster,data --halves",
          "--layers bounce,light,matrix --clamp-direct 0.01 --clamp-indirect 0.001 --halves",
          "--float-layers --cryptomatte object,material"}) {
        const std::string options = common + layers;
        const json planned =
            json::parse(w.velatura("plan --json " + options).output)["needs"]["files"][0];
        ASSERT_EQ(w.velatura("render --spp 16 --progress none " + options).exit_code, 0) << layers;
        const Result<image::Image> image = image::read_exr(w.path("a.exr"));
        ASSERT_TRUE(image.has_value());
        size_t channels = 0, bytes = 0;
        for (const image::Part& part : image->parts) {
            for (const image::Channel& c : part.channels) {
                ++channels;
                bytes += image->data.pixel_count() * (c.type() == image::ChannelType::Half ? 2 : 4);
            }
        }
        fmt::print("{}: {} of {} channels, {} of {} bytes\n", layers, channels,
                   planned["channels"].get<size_t>(), bytes, planned["most_bytes"].get<size_t>());
        EXPECT_LE(channels, planned["channels"].get<size_t>()) << layers;
        EXPECT_LE(bytes, planned["most_bytes"].get<size_t>()) << layers;
        EXPECT_GT(double(bytes), 0.5 * planned["most_bytes"].get<double>()) << layers;
    }
}

TEST_F(EffectsCommand, ForcedEffectsChangeNoPixel) {
    ASSERT_EQ(render("-o a.exr").exit_code, 0);
    ASSERT_EQ(render("-o b.exr --effects all").exit_code, 0);
    EXPECT_EQ(w.hash("a.exr"), w.hash("b.exr"));
    EXPECT_EQ(entry(header_plan("b.exr")["effects"], "depth-of-field")["forced"], true);
}

TEST_F(EffectsCommand, WhatIsLeftOutIsNotSimulatedAndTheFileSaysSo) {
    ASSERT_EQ(render("-o a.exr").exit_code, 0);
    ASSERT_EQ(render("-o b.exr --effects -clearcoat --stats b.json").exit_code, 0);
    EXPECT_NE(w.hash("a.exr"), w.hash("b.exr"));
    EXPECT_EQ(entry(header_plan("b.exr")["effects"], "clearcoat")["state"], "left out");
    std::ifstream in(w.path("b.json"));
    const json stats = json::parse(in);
    EXPECT_EQ(entry(stats["effects"], "clearcoat")["calls"], 0);
    EXPECT_EQ(stats["ledger"][0]["approximation"], "effect-left-out");
    EXPECT_EQ(stats["ledger"][0]["value"], "clearcoat");
    // The same as if the scene had never called for it
    std::string text = scene_with_effects();
    text.replace(text.find("float inputs:clearcoat = 1"), 26, "float inputs:clearcoat = 0");
    w.write("s.usda", text);
    ASSERT_EQ(render("-o c.exr").exit_code, 0);
    EXPECT_EQ(w.hash("b.exr"), w.hash("c.exr"));
}

TEST_F(EffectsCommand, RefusesNamesThatMeanNothing) {
    EXPECT_EQ(render("-o a.exr --effects clearcoat").exit_code, 2);
    EXPECT_EQ(render("-o a.exr --effects -no-such-effect").exit_code, 2);
    const CommandResult instancing = render("-o a.exr --effects -instancing");
    EXPECT_EQ(instancing.exit_code, 2);
    EXPECT_NE(instancing.output.find("cannot be switched off"), std::string::npos);
    EXPECT_NE(render("-o a.exr --effects -roulette").output.find("option of its own"),
              std::string::npos);
    EXPECT_FALSE(w.exists("a.exr"));
}

/// The example of docs/reference/effects.md is a scene of the tree: what it counts is counted here.
TEST(EffectsDocs, TheExampleCountsAsThePlanDoes) {
    const Workplace w;
    ASSERT_TRUE(copy_made_scene(w, "atelier"));
    const CommandResult plan = w.velatura("plan scenes/atelier/atelier.usda");
    ASSERT_EQ(plan.exit_code, 0) << plan.output;
    std::ifstream file(VELATURA_SOURCE_DIR "/docs/reference/effects.md");
    const std::string docs((std::istreambuf_iterator<char>(file)), {});
    const auto line = [](const std::string& text, const std::string& begin) {
        const size_t at = text.find(begin);
        return at == std::string::npos ? "" : text.substr(at, text.find('\n', at) - at);
    };
    for (const char* begin : {"atelier.usda, frame", "effect plan:", "file: atelier.exr"}) {
        EXPECT_NE(line(plan.output, begin), "") << begin;
        EXPECT_EQ(line(docs, begin), line(plan.output, begin));
    }
}

}  // namespace
}  // namespace velatura::test
