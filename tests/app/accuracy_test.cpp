// SPDX-License-Identifier: Apache-2.0
// What a render says of its own error: in its output, its statistics and the header of its file.
#include "command.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

using Json = nlohmann::json;

const std::string small = "--res 40 34 --bounces 4 -o s.exr ";

Json stats_of(const Workplace& w, const std::string& options, int exit_code = 0) {
    const CommandResult r =
        w.velatura("render s.usda -q --progress none --stats s.json " + small + options);
    EXPECT_EQ(r.exit_code, exit_code) << r.output;
    std::ifstream file(w.path("s.json"));
    return Json::parse(file);
}

Json header_stats(const Workplace& w) {
    const auto image = image::read_exr(w.path("s.exr"));
    if (!image) throw std::runtime_error(image.error().message);
    return Json::parse(image->text(layers::stats_attribute));
}

/// A lamp in a room, and another behind three panes of clear glass, six interfaces.
std::string three_panes() {
    std::string scene = R"usda(#usda 1.0
def Camera "Cam"
{
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def RectLight "Behind"
{
    float inputs:width = 1
    float inputs:height = 1
    float inputs:intensity = 2
    double3 xformOp:translate = (0, 0, -2)
    double3 xformOp:rotateXYZ = (0, 180, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}
def DistantLight "Sun"
{
    float inputs:angle = 10
}
def Mesh "Wall"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-8, -8, -3), (8, -8, -3), (8, 8, -3), (-8, 8, -3)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
def Material "Glass"
{
    token outputs:surface.connect = </Glass/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 1, 1)
        float inputs:opacity = 0
        float inputs:roughness = 0
        token outputs:surface
    }
}
)usda";
    for (int pane = 0; pane < 3; ++pane)
        scene += fmt::format(R"usda(
def Cube "Pane{}" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    rel material:binding = </Glass>
    double3 xformOp:translate = (0, 0, {})
    float3 xformOp:scale = (1, 1, 0.05)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}}
)usda",
                             pane, -0.5 * pane);
    return scene;
}

}  // namespace

/// Light through glass that hits a small lamp by chance: the image of this seed does not get
/// better.
TEST(Accuracy, ErrorsThatDoNotFallAreLowerBoundsInAllThatIsSaid) {
    const Workplace w;
    const CommandResult r = w.velatura(
        "render '" VELATURA_SOURCE_DIR
        "/scenes/transport/caustic.usda' --caustics path --res 48 36 --spp 128 "
        "--seed 22 --target-error 1% --require-target --progress none --stats x.json -o x.exr");
    EXPECT_EQ(r.exit_code, 3) << r.output;
    EXPECT_NE(r.output.find("[rare-light]"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("% or more [budget]"), std::string::npos) << r.output;
    std::ifstream file(w.path("x.json"));
    const Json stats = Json::parse(file);
    EXPECT_EQ(stats.at("error").at("is_lower"), true);
    EXPECT_EQ(stats.at("error").at("reached"), false);
    EXPECT_EQ(stats.at("forecast").at("state"), "rare-light");
    EXPECT_EQ(stats.at("forecast").at("is_lower"), true);
}

/// Few pixels hold the error: the warning names a sample of one for --replay, the brightest of it.
TEST(Accuracy, TheBrightestSampleOfTheWorstPixelIsNamed) {
    const Workplace w;
    const std::string render =
        "render '" VELATURA_SOURCE_DIR "/scenes/transport/glass.usda' --res 48 48 --spp 8";
    const std::string said = w.velatura(render + " --progress none -o x.exr").output;
    const std::regex named(
        "rare bright samples \\(fireflies\\): .*, pixel \\((\\d+), (\\d+)\\) sample (\\d), "
        "with --replay (\\S+) ");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(said, found, named)) << said;
    const std::string pixel = found.str(1) + "," + found.str(2) + ",";
    EXPECT_EQ(found.str(4), pixel + found.str(3));
    const std::regex radiance(R"(radiance \((\S+), (\S+), (\S+)\), weight)");
    std::vector<double> brightness;
    for (int s = 0; s < 8; ++s) {
        const std::string path =
            w.velatura(render + " --replay " + pixel + std::to_string(s)).output;
        std::smatch rgb;
        ASSERT_TRUE(std::regex_search(path, rgb, radiance)) << path;
        brightness.push_back(
            std::max({std::stod(rgb.str(1)), std::stod(rgb.str(2)), std::stod(rgb.str(3))}));
    }
    EXPECT_EQ(std::max_element(brightness.begin(), brightness.end()) - brightness.begin(),
              std::stoi(found.str(3)));
}

/// Light of light tracing is no firefly of a path: --replay would not show it.
TEST(Accuracy, APixelWithLightOfLightTracingIsNamedAsOne) {
    const Workplace w;
    ASSERT_TRUE(copy_made_scene(w, "atelier"));
    const std::regex named(
        "few pixels, with caustics by light tracing, hold .* pixel \\((\\d+), (\\d+)\\), of whose");
    for (const int seed : {5, 0, 1, 2, 3, 4, 6, 7}) {
        const std::string render = fmt::format(
            "render scenes/atelier/atelier.usda --res 96 54 --spp 64 --layers none --progress none "
            "--seed {} ",
            seed);
        const std::string said = w.velatura(render + "-o x.exr").output;
        std::smatch found;
        if (!std::regex_search(said, found, named)) continue;
        const int x = std::stoi(found.str(1)), y = std::stoi(found.str(2));
        w.velatura(render + fmt::format("--replay {},{} --paths p.json", x, y));
        std::ifstream file(w.path("p.json"));
        const Json of_paths = Json::parse(file).at("value");
        const auto image = image::read_exr(w.path("x.exr"));
        ASSERT_TRUE(image.has_value());
        double brightest = 0, traced = 0;
        for (size_t c = 0; c < 3; ++c) {
            const image::Channel* channel = image->find(std::string(1, "RGB"[c]));
            brightest = std::max(brightest, double(channel->value(image->data.index(x, y))));
            traced = std::max(traced, of_paths.at(c).get<double>());
        }
        // Not the same samples: adaptive sampling takes others than the first 64
        EXPECT_GT(brightest, 1.6 * traced) << said;
        return;
    }
    ADD_FAILURE() << "no seed shows it: choose others";
}

/// An edge of something bright is no firefly.
TEST(Accuracy, AnEdgeIsNamedAsOne) {
    const Workplace w;
    const std::string said =
        w.velatura("render '" VELATURA_SOURCE_DIR
                   "/scenes/cornell/cornell.usda' --res 48 48 --spp 16 --progress none -o x.exr")
            .output;
    EXPECT_NE(said.find("few pixels, at edges of something bright, hold most of the error: "),
              std::string::npos)
        << said;
    EXPECT_EQ(said.find("fireflies"), std::string::npos) << said;
}

/// What is biased, and that the layers sum to the beauty, is printed in the field's words.
TEST(Accuracy, BiasedSettingsAndTheSumOfLayersArePrinted) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const std::string render = "render s.usda --res 12 9 --spp 2 --progress none -o s.exr ";
    EXPECT_NE(w.velatura(render).output.find(" channels, AOVs sum to the beauty: OK, "),
              std::string::npos);
    EXPECT_NE(w.comp("info s.exr").output.find("biased settings: none\n"), std::string::npos);
    EXPECT_EQ(w.velatura(render + "--layers none").output.find("sum to the beauty"),
              std::string::npos);
    EXPECT_EQ(w.velatura(render + "--max-depth 2 --clamp-direct 10").exit_code, 0);
    const std::string info = w.comp("info s.exr").output;
    for (const char* line :
         {"\nbiased setting: max-depth 2: light of longer paths is missing: about ",
          "\nbiased setting: clamp direct 10", " AOVs sum to the beauty bit for bit; "})
        EXPECT_NE(info.find(line), std::string::npos) << line << info;
}

TEST(Accuracy, StatisticsHaveTheCurveAndTheForecast) {
    const Workplace w;
    // Without the lamp in view: the pixels of its edges hold most of the error, which is then a
    // lower bound without a forecast
    std::string scene = small_scene();
    const std::string in_view = "(-1.5, 1.5, 0.5)";
    ASSERT_NE(scene.find(in_view), std::string::npos);
    scene.replace(scene.find(in_view), in_view.size(), "(-1.5, 1.5, 4.5)");
    w.write("s.usda", scene);
    const Json stats = stats_of(w, "--adaptive off --forecast 4%");
    const Json& curve = stats.at("error_curve");
    ASSERT_EQ(curve.size(), 5u);
    for (size_t i = 0; i < curve.size(); ++i) {
        EXPECT_EQ(curve[i].at("spp"), double(4 << i));
        EXPECT_LT(curve[i].at("low"), curve[i].at("error"));
        EXPECT_GT(curve[i].at("high"), curve[i].at("error"));
        if (i > 0) {
            EXPECT_GT(curve[i].at("time_s"), curve[i - 1].at("time_s"));
            // The image is small, the first pair of samples too
            EXPECT_LT(curve[i].at("error"), 1.1 * double(curve[i - 1].at("error")));
        }
    }
    EXPECT_EQ(stats.at("error").at("mean"), curve.back().at("error"));
    EXPECT_EQ(stats.at("error").at("is_upper"), false);
    EXPECT_NEAR(stats.at("error_slope").at("value"), -0.55, 0.15);
    EXPECT_EQ(stats.at("forecast").at("target"), 0.04);
    const Json& layers = stats.at("error").at("layers");
    ASSERT_GT(layers.size(), 5u);
    for (const Json& layer : layers) EXPECT_GE(layer.at("error"), 0.0);
    EXPECT_EQ(layers[0].at("name"), "b0");
    const Json& blocks = stats.at("error").at("blocks");
    EXPECT_GT(blocks.at("half_of_error_in"), 0.0);
    EXPECT_LE(blocks.at("half_of_error_in"), 0.5);
    ASSERT_EQ(blocks.at("worst").size(), 5u);
    EXPECT_GE(blocks.at("worst")[0].at("error"), blocks.at("worst")[1].at("error"));
    // Half the error of the last point and a little less is four times the samples or so
    const double half = 0.5 * double(curve.back().at("error"));
    const Json again = stats_of(w, "--adaptive off --forecast " + std::to_string(half));
    ASSERT_EQ(again.at("forecast").at("state"), "forecast");
    EXPECT_NEAR(again.at("forecast").at("spp"), 270, 90);
    EXPECT_LT(again.at("forecast").at("time_low_s"), again.at("forecast").at("time_high_s"));
}

TEST(Accuracy, ARenderSaysWhatItsTargetNeeds) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const CommandResult near =
        w.velatura("render s.usda --progress json --spp 16 --res 40 34 -o s.exr --forecast 10%");
    EXPECT_EQ(near.exit_code, 0) << near.output;
    EXPECT_NE(near.output.find("16 spp reached "), std::string::npos) << near.output;
    EXPECT_NE(near.output.find("\"forecast\""), std::string::npos) << near.output;
    const CommandResult far =
        w.velatura("render s.usda --spp 16 --res 40 34 -o s.exr --target-error 0.01%");
    EXPECT_EQ(far.exit_code, 0) << far.output;
    EXPECT_NE(far.output.find(
                  "0.01 % needs more than 10 times these samples, beyond the range of a forecast"),
              std::string::npos)
        << far.output;
    EXPECT_EQ(w.velatura("render s.usda --mode tile --forecast 1% -o s.exr").exit_code, 2);
}

TEST(Accuracy, TheHeaderHasOnlyWhatEveryRunSays) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const Json stats = stats_of(w, "--forecast 4%");
    const Json header = header_stats(w);
    EXPECT_EQ(header.at("error").at("is_upper"), false);
    EXPECT_GT(header.at("error").at("mean"), 0.0);
    EXPECT_EQ(header.dump().find("time"), std::string::npos);
    // The same from tiles, of which no curve is known, and from parts
    const Json tiles = stats_of(w, "--mode tile");
    EXPECT_EQ(header_stats(w), header);
    EXPECT_EQ(tiles.at("error").at("mean"), header.at("error").at("mean"));
    EXPECT_EQ(tiles.at("error").at("is_upper"), false);
    // Parts that do not begin with the first sample have their halves alone
    stats_of(w, "--mode tile --samples 8:16");
    EXPECT_EQ(header_stats(w).at("error").at("is_upper"), true);
    EXPECT_FALSE(tiles.contains("error_curve"));
}

TEST(Accuracy, TheLedgerMeasuresWhatADepthCutsOff) {
    // The bounces of the first fall steadily. In the second most light past the limit comes through
    // three panes, which the bounces before it do not show
    for (const std::string& scene : {small_scene(), three_panes()}) {
        const Workplace w;
        w.write("s.usda", scene);
        const auto light = [&](const std::string& options) {
            stats_of(w, options);
            const auto image = image::read_exr(w.path("s.exr"));
            double sum = 0;
            for (const char* c : {"R", "G", "B"}) {
                const image::Channel* channel = image->find(c);
                for (size_t i = 0; i < image->data.pixel_count(); ++i)
                    sum += double(channel->value(i));
            }
            return sum;
        };
        const double whole = light("--adaptive off --spp 256"),
                     cut = light("--adaptive off --spp 256 --max-depth 4");
        const Json entry = header_stats(w).at("ledger").at(0);
        ASSERT_EQ(entry.at("approximation"), "max-depth");
        const double missing = 1 - cut / whole, low = entry.at("low"), high = entry.at("high");
        std::printf("%.3f %% are missing; the trial found %.3f to %.3f %%\n", 100 * missing,
                    100 * low, 100 * high);
        EXPECT_GT(missing, 0.001);
        EXPECT_LE(low, missing);
        EXPECT_GE(high, missing);
        EXPECT_LT(high - low, missing);
        EXPECT_NEAR(entry.at("missing_share"), missing, 0.35 * missing);
        // Whatever is stored
        stats_of(w, "--max-depth 4 --layers none");
        EXPECT_EQ(header_stats(w).at("ledger").at(0), entry);
    }
}

TEST(Accuracy, TheLedgerMeasuresADepthThatCutsOffNothing) {
    const Workplace w;
    w.write("s.usda", small_scene());
    stats_of(w, "--max-depth 1000");
    const Json entry = header_stats(w).at("ledger").at(0);
    EXPECT_EQ(entry.at("missing_share"), 0.0);
    // What 1024 paths did not meet is rarer than 3 in 1024
    EXPECT_GT(entry.at("high"), 0.0);
    EXPECT_LT(entry.at("high"), 0.003);
}

TEST(Accuracy, StorageHasAnError) {
    const Workplace w;
    w.write("s.usda", small_scene());
    const double half = stats_of(w, "").at("error").at("storage"),
                 whole = stats_of(w, "--float-layers").at("error").at("storage");
    // Roundings of 11 bits, of 24
    EXPECT_GT(half, 1e-5);
    EXPECT_LT(half, 0x1p-11);
    EXPECT_LT(whole, 0x1p-22);
}

}  // namespace velatura::test
