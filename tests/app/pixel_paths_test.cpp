// SPDX-License-Identifier: Apache-2.0
// Light paths of a pixel: what is written adds up to the pixel of a render, bit for bit.
#include "command.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

using nlohmann::json;

/// Red, green, blue in double, as sums are kept.
using Sum = std::array<double, 3>;

Sum operator+(const Sum& a, const Sum& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

/// Pairs of samples, pairs of pairs … (docs/engineering/numerics.md), written anew. samples: of an
/// aligned block of a power of two.
Sum dyadic(const std::vector<Sum>& samples, size_t begin, size_t end) {
    if (end - begin == 1) return samples[begin];
    const size_t middle = (begin + end) / 2;
    return dyadic(samples, begin, middle) + dyadic(samples, middle, end);
}

/// Of samples from 0 on: the largest blocks, one after the other.
Sum total(const std::vector<Sum>& samples) {
    Sum sum{};
    for (size_t begin = 0; begin < samples.size();) {
        size_t size = 1;
        while (begin % (2 * size) == 0 && begin + 2 * size <= samples.size()) size *= 2;
        sum = begin == 0 ? dyadic(samples, begin, begin + size)
                         : sum + dyadic(samples, begin, begin + size);
        begin += size;
    }
    return sum;
}

/// What the contributions of a file add up to, by layer; "" is the beauty.
std::map<std::string, std::vector<Sum>> sums_of(const json& paths) {
    std::map<std::string, std::vector<Sum>> sums;
    const size_t count = paths.at("paths").size();
    sums[""].resize(count);
    for (size_t s = 0; s < count; ++s) {
        for (const json& light : paths.at("paths")[s].at("lights")) {
            const auto c = light.at("contribution").get<std::array<float, 3>>();
            const auto add = [&](const std::string& layer, const Sum& share) {
                std::vector<Sum>& rows = sums[layer];
                rows.resize(count);
                rows[s] = rows[s] + Sum{double(c[0]) * share[0], double(c[1]) * share[1],
                                        double(c[2]) * share[2]};
            };
            add("", {1, 1, 1});
            for (const auto& [layer, share] : light.at("layers").items())
                add(layer, share.get<Sum>());
        }
    }
    return sums;
}

class PixelPaths : public testing::Test {
  protected:
    /// Renders, and traces pixels again; every sum is the pixel's.
    void expect_sums(const std::string& scene, const std::string& options, int spp) {
        const std::string how = fmt::format(
            "render {} --res 32 24 --filter box --float-layers --spp {} {} --progress none ", scene,
            spp, options);
        ASSERT_EQ(w.velatura(how + "-q -o x.exr").exit_code, 0);
        const Result<image::Image> image = image::read_exr(w.path("x.exr"));
        ASSERT_TRUE(image);
        size_t layers = 0, found = 0;
        for (const auto& [x, y] : {std::pair(16, 12), std::pair(5, 20), std::pair(27, 3)}) {
            const CommandResult r =
                w.velatura(how + fmt::format("--replay {},{} --paths p.json --paths p.usda", x, y));
            ASSERT_EQ(r.exit_code, 0) << r.output;
            const json paths = json::parse(std::ifstream(w.path("p.json")));
            ASSERT_EQ(paths.at("paths").size(), size_t(spp));
            const size_t at = size_t(y) * 32 + size_t(x);
            const auto value = paths.at("value").get<std::array<float, 3>>();
            for (const auto& [layer, samples] : sums_of(paths)) {
                const Sum sum = total(samples);
                for (int c = 0; c < 3; ++c) {
                    const std::string name =
                        (layer.empty() ? std::string() : layer + ".") + "RGB"[c];
                    const image::Channel* channel = image->find(name);
                    if (!channel) continue;
                    ++layers;
                    const auto expected = float(sum[size_t(c)] / spp);
                    if (layer.empty()) {
                        // Of the file, which is the sum of its layers as they are stored
                        EXPECT_EQ(value[size_t(c)], channel->value(at)) << name;
                        EXPECT_NEAR(expected, channel->value(at), 1e-6f * expected);
                        continue;
                    }
                    EXPECT_EQ(channel->value(at), expected) << name << " " << x << " " << y;
                }
            }
            for (const json& path : paths.at("paths")) found += path.at("lights").size();
        }
        EXPECT_GT(layers, 9u);
        EXPECT_GT(found, size_t(spp));
    }

    /// What --replay writes.
    json trace(const std::string& arguments) {
        const CommandResult r =
            w.velatura("render " + arguments + " --paths p.json --paths p.usda");
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return json::parse(std::ifstream(w.path("p.json")));
    }

    Workplace w;
};

}  // namespace

TEST_F(PixelPaths, AddUpToThePixelBitForBit) {
    w.write("s.usda", small_scene());
    expect_sums("s.usda", "", 16);
    expect_sums("s.usda", "--layers bounce,light,matrix,lobe", 12);
    expect_sums("'" VELATURA_SOURCE_DIR "/scenes/transport/glass.usda'",
                "--splitting off --caustics path", 8);
    expect_sums("s.usda", "--adaptive off", 64);
}

TEST_F(PixelPaths, NoteThatAdaptiveSamplingTakesOtherSamples) {
    w.write("s.usda", small_scene());
    const auto has_note = [&](const std::string& options) {
        const CommandResult r =
            w.velatura("render s.usda --res 32 24 --paths p.json --replay " + options);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return r.output.find("[replay]") != std::string::npos;
    };
    EXPECT_TRUE(has_note("16,12 --spp 64"));
    EXPECT_FALSE(has_note("16,12 --spp 64 --adaptive off"));
    // All of them are pilot samples; and one sample is that one
    EXPECT_FALSE(has_note("16,12 --spp 16"));
    EXPECT_FALSE(has_note("16,12,20 --spp 64"));
}

TEST_F(PixelPaths, KeepLightInShadowAndCausticsApart) {
    size_t caustics = 0, in_shadow = 0;
    for (const char* pixel : {"10,10", "8,9", "6,11"}) {
        const json paths = trace("'" VELATURA_SOURCE_DIR
                                 "/scenes/transport/caustic.usda' --caustics manifold --res 16 16 "
                                 "--spp 16 --splitting off --replay " +
                                 std::string(pixel));
        for (const json& path : paths.at("paths")) {
            for (const json& light : path.at("lights")) {
                const bool is_shadowed = light.at("found") == "light sampled, in shadow";
                in_shadow += is_shadowed;
                if (light.at("found") != "caustic solved for") continue;
                ++caustics;
                EXPECT_FALSE(light.contains("light_pdf")) << light;
                EXPECT_EQ(light.at("light"), "");
            }
        }
    }
    EXPECT_GT(caustics, 0u);
    EXPECT_GT(in_shadow, 0u);
}

TEST_F(PixelPaths, HaveCurvesAsLongAsTheyWent) {
    w.write("s.usda", small_scene());
    size_t by_roulette = 0, escaped = 0;
    for (const char* pixel : {"16,12", "5,20", "27,3"}) {
        const json paths =
            trace("s.usda --res 32 24 --spp 64 --adaptive off --roulette constant --replay " +
                  std::string(pixel));
        std::string expected;
        for (const json& path : paths.at("paths")) {
            for (const json& end : path.at("ends")) {
                size_t points = 1;
                for (int v = end.at("vertex"); v >= 0;
                     v = path.at("vertices").at(size_t(v)).at("from"))
                    ++points;
                by_roulette += end.at("why") == "ended by roulette";
                if (end.at("why") == "escaped") ++points, ++escaped;
                expected +=
                    (expected.empty() ? "" : ", ") + std::to_string(std::max(points, size_t(2)));
            }
        }
        std::ifstream file(w.path("p.usda"));
        const std::string text((std::istreambuf_iterator<char>(file)), {});
        EXPECT_NE(text.find("curveVertexCounts = [" + expected + "]"), std::string::npos) << pixel;
    }
    EXPECT_GT(by_roulette, 0u);
    EXPECT_GT(escaped, 0u);
}

/// Branches that pass a half-transparent surface have later vertices of the same bounce.
TEST_F(PixelPaths, BranchesGoOnFromWhereThePathDivides) {
    w.write("s.usda", R"(#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
)
def Camera "Cam"
{
    float focalLength = 20
    double3 xformOp:translate = (0, 1, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Room"
{
    int[] faceVertexCounts = [4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 7, 6, 5, 0, 3, 7, 4, 1, 5, 6, 2]
    point3f[] points = [(-3, -2, 5), (3, -2, 5), (3, -2, -4), (-3, -2, -4), (-3, 4, 5), (3, 4, 5),
        (3, 4, -4), (-3, 4, -4)]
    uniform token subdivisionScheme = "none"
    uniform bool doubleSided = 1
    color3f[] primvars:displayColor = [(0.8, 0.8, 0.8)]
}
def Mesh "Veil" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, -2, 0), (3, -2, 0), (3, 4, 0), (-3, 4, 0)]
    uniform token subdivisionScheme = "none"
    uniform bool doubleSided = 1
    rel material:binding = </Half>
}
def Material "Half"
{
    token outputs:surface.connect = </Half/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.8, 0.8, 0.8)
        float inputs:opacity = 0.5
        float inputs:ior = 1
        float inputs:roughness = 1
        token outputs:surface
    }
}
def RectLight "Lamp"
{
    float inputs:intensity = 20
    float inputs:width = 0.3
    float inputs:height = 0.3
    double3 xformOp:translate = (0, 3.8, 2)
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
)");
    size_t branches = 0, passed = 0;
    for (const char* pixel : {"8,6", "4,9", "12,3"}) {
        const json paths =
            trace("s.usda --res 16 12 --spp 64 --adaptive off --guiding off --replay " +
                  std::string(pixel));
        for (const json& path : paths.at("paths")) {
            branches += path.at("ends").size() - 1;
            for (const json& v : path.at("vertices")) {
                const int from = v.at("from");
                const json& before = from < 0 ? path.at("camera").at("position")
                                              : path.at("vertices").at(size_t(from)).at("position");
                double way2 = 0;
                for (size_t k = 0; k < 3; ++k) {
                    const double step = v.at("position")[k].get<double>() - before[k].get<double>();
                    way2 += step * step;
                }
                EXPECT_NEAR(std::sqrt(way2), v.at("distance").get<double>(), 1e-3);
                passed +=
                    from >= 0 && v.at("bounce") == path.at("vertices")[size_t(from)].at("bounce");
            }
        }
    }
    EXPECT_GT(branches, 0u);
    EXPECT_GT(passed, 0u);
}

TEST_F(PixelPaths, AreWrittenWhateverTheSceneIsCalled) {
    w.write("c\xe9.usda", small_scene());
    const json paths = trace("'c\xe9.usda' --res 32 24 --spp 1 --replay 16,12");
    EXPECT_EQ(paths.at("scene").get<std::string>().substr(0, 1), "c");
}

TEST_F(PixelPaths, SayWhereAndHowLightWasFound) {
    w.write("s.usda", R"(#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
def Camera "Cam"
{
    float focalLength = 20
    double3 xformOp:translate = (100, 200, 310)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Floor"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(90, 190, 300), (110, 190, 300), (110, 210, 300), (90, 210, 300)]
    uniform token subdivisionScheme = "none"
}
def SphereLight "Lamp"
{
    float inputs:radius = 0.5
    double3 xformOp:translate = (100, 200, 305)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)");
    const std::string how = "render s.usda --res 8 8 --spp 4 --layers matrix ";
    ASSERT_EQ(w.velatura(how + "--replay 2,3 --paths p.json --paths p.usda").exit_code, 0);
    const json paths = json::parse(std::ifstream(w.path("p.json")));
    EXPECT_EQ(paths.at("pixel"), json({2, 3}));
    size_t sampled = 0;
    for (const json& path : paths.at("paths")) {
        // Rays begin at the near plane
        const auto origin = path.at("camera").at("position").get<std::array<double, 3>>();
        const auto d = path.at("camera").at("direction").get<std::array<double, 3>>();
        const double way = (origin[2] - 310.0) / d[2];
        EXPECT_NEAR(origin[2], 309.0, 1e-4);
        EXPECT_NEAR(origin[0] - way * d[0], 100.0, 1e-4);
        EXPECT_NEAR(origin[1] - way * d[1], 200.0, 1e-4);
        const json& first = path.at("vertices").at(0);
        EXPECT_EQ(first.at("prim"), "/Floor");
        EXPECT_EQ(first.at("from"), -1);
        EXPECT_NEAR(first.at("position")[2].get<double>(), 300.0, 1e-4);
        EXPECT_EQ(first.at("throughput"), json({1.0, 1.0, 1.0}));
        for (const json& light : path.at("lights")) {
            if (light.at("found") != "light sampled") continue;
            ++sampled;
            EXPECT_EQ(light.at("light"), "/Lamp");
            EXPECT_EQ(light.at("vertex"), 0);
            EXPECT_EQ(light.at("layers"), json({{"b1_Lamp", {1.0, 1.0, 1.0}}}));
            // On the ball, and weighed as the two densities say
            double distance2 = 0;
            for (size_t k = 0; k < 3; ++k) {
                const double middle[] = {100, 200, 305};
                const double off = light.at("position")[k].get<double>() - middle[k];
                distance2 += off * off;
            }
            EXPECT_NEAR(distance2, 0.25, 1e-4);
            const double a = light.at("light_pdf"), b = light.at("scatter_pdf");
            EXPECT_NEAR(light.at("mis_weight").get<double>(), a * a / (a * a + b * b), 1e-5);
            EXPECT_EQ(light.at("unshadowed"), light.at("contribution"));
        }
    }
    EXPECT_EQ(sampled, 4u);

    // A layer that any reader opens, with a curve for every path
    const CommandResult flat = w.velatura("flatten p.usda -o flat.usda");
    EXPECT_EQ(flat.exit_code, 0) << flat.output;
    std::ifstream file(w.path("flat.usda"));
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    EXPECT_NE(text.find("upAxis = \"Z\""), std::string::npos) << text.substr(0, 400);
    EXPECT_NE(text.find("def BasisCurves \"Paths\""), std::string::npos);
    EXPECT_NE(text.find("def BasisCurves \"Lights\""), std::string::npos);
    std::smatch counts;
    ASSERT_TRUE(std::regex_search(text, counts, std::regex("curveVertexCounts = \\[([^\\]]*)\\]")));
    const std::string list = counts.str(1);
    EXPECT_EQ(std::count(list.begin(), list.end(), ','), 3) << list;
    EXPECT_NE(w.velatura("info p.usda").output.find("2 BasisCurves"), std::string::npos);
}

TEST_F(PixelPaths, RefuseWhatTheyCannotDo) {
    w.write("s.usda", small_scene());
    for (const char* arguments :
         {"--paths p.json", "--replay 1,1 --paths p.exr",

          "--replay 40,1 --paths p.json --res 32 24", "--replay 1,1 --paths p.json -f 1,2"}) {
        const CommandResult r =
            w.velatura(std::string("render s.usda --res 32 24 --spp 1 ") + arguments);
        EXPECT_EQ(r.exit_code, 2) << arguments << "\n" << r.output;
    }
    EXPECT_EQ(w.velatura("render s.usda --replay 1,1 --paths p.json --time 1s").exit_code, 2);
    EXPECT_FALSE(w.exists("p.json"));
    // One sample, and one that is not in a file
    EXPECT_EQ(w.velatura("render s.usda --res 32 24 --replay 1,1,7 --paths p.json").exit_code, 0);
    const json one = json::parse(std::ifstream(w.path("p.json")));
    EXPECT_EQ(one.at("samples"), json({7, 8}));
    const CommandResult said = w.velatura("render s.usda --res 32 24 --spp 2 --replay 1,1");
    EXPECT_NE(said.output.find("pixel (1, 1) sample 1: radiance"), std::string::npos);
}

}  // namespace velatura::test
