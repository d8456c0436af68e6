// SPDX-License-Identifier: Apache-2.0
// Layers by light path expressions, of lobes and of render vars: against layers that are made
// without them, against the lights' own multipliers of lobes, and against materials that have one
// lobe.
#include "base/atomic_file.h"
#include "command.h"
#include "film/cryptomatte_decoder.h"
#include "image/exr.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

std::string ball(const std::string& name, const std::string& inputs, double x) {
    return fmt::format(R"usda(
    def Material "{0}"
    {{
        token outputs:surface.connect = </W/{0}/S.outputs:surface>
        def Shader "S"
        {{
            {1}
            token outputs:surface
        }}
    }}
    def Sphere "{0}Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        rel material:binding = </W/{0}>
        double radius = 0.5
        double3 xformOp:translate = ({2}, 0.5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }})usda",
                       name, inputs, x);
}

const std::string preview = "uniform token info:id = \"UsdPreviewSurface\"\n            ";

/// A floor and balls under a rect light with these multipliers of lobes, and more prims.
std::string room(double diffuse,
                 double specular,
                 const std::string& more = "",
                 const std::string& metadata = "") {
    std::string text = "#usda 1.0\n(\n" + metadata + R"usda(
)
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 35
        float horizontalAperture = 36
        float verticalAperture = 18
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 0.6, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.6, 0.5, 0.4)]
    })usda";
    text += ball("Coated",
                 preview +
                     "color3f inputs:diffuseColor = (0.5, 0.2, 0.1)\n            float "
                     "inputs:roughness = 0.4\n            float inputs:clearcoat = 1\n            "
                     "float inputs:clearcoatRoughness = 0.25",
                 -1.8);
    text +=
        ball("Metal", preview + "float inputs:metallic = 1\n            float inputs:roughness = 0",
             -0.6);
    text += ball("Glass",
                 preview + "float inputs:opacity = 0\n            float inputs:roughness = 0", 0.6);
    text += ball("Wax",
                 "uniform token info:id = \"ND_open_pbr_surface_surfaceshader\"\n            float "
                 "inputs:subsurface_weight = 1\n            float inputs:subsurface_radius = 0.1",
                 1.8);
    return text +
           fmt::format(R"usda(
    def RectLight "key"
    {{
        float inputs:intensity = 8
        float inputs:width = 3
        float inputs:height = 3
        float inputs:diffuse = {}
        float inputs:specular = {}
        double3 xformOp:translate = (0, 4, 2)
        float xformOp:rotateX = -65
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }}
    def DomeLight "sky"
    {{
        float inputs:intensity = 0.2
    }}
}}
)usda",
                       diffuse, specular) +
           more;
}

class LightPathLayers : public testing::Test {
  protected:
    image::Image render(const std::string& scene, const std::string& arguments) {
        w.write("s.usda", scene);
        const CommandResult r =
            w.velatura("render s.usda --res 48 24 --progress none -q -o out.exr " + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        output = r.output;
        const CommandResult verified = w.comp("verify out.exr");
        EXPECT_EQ(verified.exit_code, 0) << verified.output;
        Result<image::Image> image = image::read_exr(w.path("out.exr"));
        if (!image) throw std::runtime_error(image.error().message);
        return std::move(*image);
    }

    Workplace w;
    std::string output;
};

/// Values of a layer, one channel after the other; of one that is not stored, zeros.
std::vector<float> layer(const image::Image& image, const std::string& name) {
    std::vector<float> out(3 * image.data.pixel_count(), 0.0f);
    const char* channels[] = {".R", ".G", ".B"};
    for (size_t c = 0; c < 3; ++c) {
        if (const image::Channel* channel = image.find(name + channels[c]))
            image::for_each_value(
                *channel, [&](size_t i, float v) { out[c * image.data.pixel_count() + i] = v; });
    }
    return out;
}

std::vector<float> sum(const image::Image& image, const std::vector<std::string>& names) {
    std::vector<float> out(3 * image.data.pixel_count(), 0.0f);
    for (const std::string& name : names) {
        const std::vector<float> values = layer(image, name);
        for (size_t i = 0; i < out.size(); ++i) out[i] += values[i];
    }
    return out;
}

void expect_same(const std::vector<float>& a,
                 const std::vector<float>& b,
                 float scale,
                 const std::string& what) {
    double total = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        ASSERT_NEAR(a[i], scale * b[i], 2e-5f * std::abs(a[i]) + 1e-6f) << what << ", value " << i;
        total += double(a[i]);
    }
    EXPECT_GT(total, 1.0) << what;
}

}  // namespace

/// Every layer of light says by which expression it can be had: it must be that one, bit for bit.
TEST_F(LightPathLayers, GiveEveryLayerByItsOwnExpression) {
    const std::string common =
        "--spp 20 --bounces 3 --float-layers --layers bounce,light,matrix,shadow ";
    for (const std::string how : {"", "--guiding on --splitting auto ", "--integrator naive ",
                                  "--clamp-indirect 0.05 --clamp-direct 0.5 "}) {
        SCOPED_TRACE(how);
        const image::Image plain = render(small_scene(), common + how);
        const Result<layers::LayerHeader> header = layers::read_layer_header(plain);
        ASSERT_TRUE(header.has_value());
        std::string options;
        std::vector<std::string> names;
        for (const accumulate::LayerEntry& e : header->layers) {
            if (e.lpe.empty() || e.name == "rgba" || e.is_empty) continue;
            options += fmt::format("--lpe \"x{}={}\" ", names.size(), e.lpe);
            names.push_back(e.name);
        }
        ASSERT_GT(names.size(), 20u);
        const image::Image both = render(small_scene(), common + how + options);
        for (size_t i = 0; i < names.size(); ++i) {
            const std::vector<float> expected = layer(plain, names[i]),
                                     with = layer(both, names[i]),
                                     by_paths = layer(both, fmt::format("x{}", i));
            for (size_t k = 0; k < expected.size(); ++k) {
                ASSERT_EQ(std::bit_cast<uint32_t>(with[k]), std::bit_cast<uint32_t>(expected[k]))
                    << names[i] << " changed by being looked at";
                // The beauty's own layers are folds of stored cells; sums of the same contributions
                // differ in the last bit
                ASSERT_NEAR(by_paths[k], expected[k], 3e-7f * std::abs(expected[k]) + 1e-9f)
                    << names[i];
            }
        }
    }
}

/// Every cell by light, bounce and lobe is what its own expression picks, however light is found;
/// its sums are the layers of coarser sets.
TEST_F(LightPathLayers, GiveEveryCellOfTheLobeMatrixByItsOwnExpression) {
    std::string scene = room(1, 1);
    const std::string common = "--spp 12 --bounces 3 --float-layers ";
    for (const std::string how :
         {"", "--guiding on --splitting auto ", "--caustics light ", "--integrator naive ",
          "--clamp-indirect 0.05 --clamp-direct 0.5 ", "--bounces 0 "}) {
        SCOPED_TRACE(how);
        const image::Image plain = render(scene, common + "--layers lobe-matrix " + how);
        const Result<layers::LayerHeader> header = layers::read_layer_header(plain);
        ASSERT_TRUE(header.has_value());
        EXPECT_EQ(header->closure.front().family, "lobe-matrix");
        std::string options;
        std::vector<std::string> names;
        for (const accumulate::LayerEntry& e : header->layers) {
            if (e.lpe.empty() || e.name == "rgba" || e.is_empty) continue;
            EXPECT_EQ(e.name, e.bounce + "_" + e.group + "_" + e.lobe);
            options += fmt::format("--lpe \"x{}={}\" ", names.size(), e.lpe);
            names.push_back(e.name);
        }
        ASSERT_GT(names.size(), how == "--bounces 0 " ? 8u : 20u);
        const image::Image both = render(
            scene, common + "--layers lobe-matrix,matrix,bounce,light,lobe " + how + options);
        const image::Image coarse =
            render(scene, common + "--layers matrix,bounce,light,lobe " + how);
        for (size_t i = 0; i < names.size(); ++i) {
            const std::vector<float> expected = layer(plain, names[i]),
                                     with = layer(both, names[i]),
                                     by_paths = layer(both, fmt::format("x{}", i));
            for (size_t k = 0; k < expected.size(); ++k) {
                ASSERT_EQ(std::bit_cast<uint32_t>(with[k]), std::bit_cast<uint32_t>(expected[k]))
                    << names[i] << " changed by being looked at";
                ASSERT_NEAR(by_paths[k], expected[k], 3e-7f * std::abs(expected[k]) + 1e-9f)
                    << names[i];
            }
        }
        const Result<layers::LayerHeader> of_coarse = layers::read_layer_header(coarse);
        ASSERT_TRUE(of_coarse.has_value());
        for (const accumulate::LayerEntry& e : of_coarse->layers) {
            if (!e.in_sum && e.family != "bounces" && e.family != "groups") continue;
            const std::vector<float> expected = layer(coarse, e.name), sum = layer(both, e.name);
            for (size_t k = 0; k < expected.size(); ++k)
                ASSERT_NEAR(sum[k], expected[k], 1e-6f * std::abs(expected[k]) + 1e-9f) << e.name;
        }
    }
}

/// Against other renders: of one lobe, by a light that has light for no other, and of one light.
TEST_F(LightPathLayers, CellsOfTheLobeMatrixAreRendersOfOneLightAndOneLobe) {
    const std::string how =
        "--spp 64 --adaptive off --splitting off --guiding off --caustics path "
        "--roulette throughput --bounces 2 --float-layers --halves --layers lobe-matrix";
    const auto with = [&](double diffuse, double specular, bool has_sky) {
        std::string scene = room(diffuse, specular);
        if (!has_sky) scene.replace(scene.find("intensity = 0.2"), 15, "intensity = 0.0");
        return render(scene, how);
    };
    const image::Image all = with(1, 1, true), no_sky = with(1, 1, false),
                       specular = with(0, 1, false);
    const std::vector<float> diffuse = layer(specular, "b1_key_diffuse");
    EXPECT_TRUE(std::all_of(diffuse.begin(), diffuse.end(), [](float v) { return v == 0.0f; }));
    for (const char* lobe : {"specular", "coat"}) {
        const std::string name = std::string("b1_key_") + lobe;
        expect_same(layer(specular, name), layer(no_sky, name), 1, name + " alone");
    }
    // With the sky the same light is found by other random numbers: z-scores of the sums over the
    // image, whose errors the half images tell
    for (const std::string name : {"b1_key_diffuse", "b1_key_specular", "b2_key_diffuse"}) {
        const auto total = [&](const image::Image& image, double& variance) {
            double sum = 0;
            const std::vector<float> whole = layer(image, name), a = layer(image, name + "_hA"),
                                     b = layer(image, name + "_hB");
            for (size_t i = 0; i < whole.size(); ++i) {
                sum += double(whole[i]);
                variance += 0.25 * double(a[i] - b[i]) * double(a[i] - b[i]);
            }
            return sum;
        };
        double variance = 0;
        const double a = total(all, variance), b = total(no_sky, variance);
        EXPECT_GT(b, 1.0) << name;
        EXPECT_LT(std::abs(a - b), 4 * std::sqrt(variance)) << name << ": " << a << ", " << b;
        std::printf("%s: the smallest difference that is found is %.2f %%\n", name.c_str(),
                    100 * 4 * std::sqrt(variance) / b);
    }
}

TEST_F(LightPathLayers, LobesOfDirectLightAreWhatTheLightsMultipliersKeep) {
    // Light that is sampled, and light that paths meet
    for (const std::string integrator : {"path", "naive", "nee"}) {
        const std::string how =
            "--spp 8 --adaptive off --splitting off --guiding off --caustics path "
            "--roulette throughput --layers bounce,lobe --float-layers --integrator " +
            integrator;
        const auto with = [&](double diffuse, double specular) {
            std::string scene = room(diffuse, specular);
            // One light alone has them
            scene.replace(scene.find("intensity = 0.2"), 15, "intensity = 0.0");
            return render(scene, how);
        };
        const image::Image all = with(1, 1), diffuse = with(1, 0), specular = with(0, 1),
                           other = with(0.5, 2);
        // Subsurface counts as diffuse; what mirrors and glass show of the light is specular
        expect_same(layer(diffuse, "b1"), sum(all, {"diffuse_direct", "subsurface_direct"}), 1,
                    integrator + ": diffuse");
        expect_same(layer(specular, "b1"),
                    sum(all, {"specular_direct", "coat_direct", "transmit_direct"}), 1,
                    integrator + ": specular");
        expect_same(layer(other, "diffuse_direct"), layer(all, "diffuse_direct"), 0.5f,
                    integrator + ": half diffuse");
        expect_same(layer(other, "specular_direct"), layer(all, "specular_direct"), 2,
                    integrator + ": twice specular");
        expect_same(layer(other, "coat_direct"), layer(all, "coat_direct"), 2,
                    integrator + ": twice coat");
    }
}

TEST_F(LightPathLayers, LobesAddUpToBouncesAndBelongToTheirMaterials) {
    const image::Image image =
        render(room(1, 1),
               // Splats of light tracing reach into pixels whose samples all met another surface
               "--spp 16 --bounces 8 --cryptomatte material --layers bounce,lobe --float-layers "
               "--caustics path");
    const std::vector<std::string> lobes = {"diffuse",  "specular",   "coat",
                                            "transmit", "subsurface", "volume"};
    std::vector<std::string> direct, indirect;
    for (const std::string& lobe : lobes) {
        direct.push_back(lobe + "_direct");
        indirect.push_back(lobe + "_indirect");
    }
    expect_same(layer(image, "b1"), sum(image, direct), 1, "direct");
    expect_same(sum(image, {"b2", "b3", "b4", "b5", "b6", "b7", "b8", "tail"}),
                sum(image, indirect), 1, "indirect");
    EXPECT_EQ(layer(image, "emission"), layer(image, "b0"));

    // Where a material covers the pixel, only its lobes bring light
    const CryptomatteDecoder mattes(image, "CryptoMaterial");
    const auto brings = [&](const std::string& material, const std::string& lobe) {
        const std::vector<float> matte = mattes.matte(material),
                                 light = sum(image, {lobe + "_direct", lobe + "_indirect"});
        double total = 0;
        size_t whole = 0;
        for (size_t i = 0; i < matte.size(); ++i) {
            if (matte[i] < 1.0f) continue;
            ++whole;
            total += double(light[i]);
        }
        EXPECT_GT(whole, 5u) << material;
        return total > 1e-4;
    };
    const auto expect_lobes = [&](const std::string& material,
                                  const std::vector<std::string>& expected) {
        for (const std::string& lobe : lobes) {
            const bool is_expected =
                std::find(expected.begin(), expected.end(), lobe) != expected.end();
            EXPECT_EQ(brings(material, lobe), is_expected) << lobe << " of " << material;
        }
    };
    expect_lobes("/W/Coated", {"diffuse", "specular", "coat"});
    expect_lobes("/W/Metal", {"specular"});
    expect_lobes("/W/Glass", {"specular", "transmit"});
    expect_lobes("/W/Wax", {"specular", "subsurface"});
    expect_lobes("default", {"diffuse"});
}

/// All families, halves and clamps together: every name is one that files take.
TEST_F(LightPathLayers, LobesHaveShortNames) {
    const image::Image image =
        render(room(1, 1),
               "--spp 4 --layers lobe,bounce --halves --clamp-direct 0.01 --clamp-indirect 0.001");
    EXPECT_NE(image.find("clamp_transmit_indirect_hA.R"), nullptr);
}

/// A mirror shows a veil, at which paths divide, before a light whose lobes count differently.
TEST_F(LightPathLayers, BranchesKeepTheirLabels) {
    const std::string scene = R"usda(#usda 1.0
def Xform "World"
{
    def Camera "cam"
    {
        float focalLength = 35
        float horizontalAperture = 36
        float verticalAperture = 24
        double3 xformOp:translate = (0, 1, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Plane "mirror" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform token axis = "Z"
        double width = 20
        double length = 20
        double3 xformOp:translate = (0, 0, -2)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel material:binding = </World/chrome>
    }
    def Plane "veil" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform token axis = "Z"
        double width = 40
        double length = 40
        double3 xformOp:translate = (0, 0, 6)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel material:binding = </World/veil_m>
    }
    def Cube "stuff" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        double size = 1
        double3 xformOp:translate = (-2, 0, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def RectLight "key"
    {
        float inputs:width = 6
        float inputs:height = 6
        float inputs:intensity = 3
        float inputs:diffuse = 3
        float inputs:specular = 0.5
        double3 xformOp:translate = (0, 1, 9)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def SphereLight "fill"
    {
        float inputs:radius = 0.2
        float inputs:intensity = 20
        double3 xformOp:translate = (3, 4, 2)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Material "chrome"
    {
        token outputs:surface.connect = </World/chrome/s.outputs:surface>
        def Shader "s"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.9, 0.9, 0.9)
            float inputs:metallic = 1
            float inputs:roughness = 0
            token outputs:surface
        }
    }
    def Material "veil_m"
    {
        token outputs:surface.connect = </World/veil_m/s.outputs:surface>
        def Shader "s"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.7, 0.7, 0.7)
            float inputs:opacity = 0.4
            float inputs:ior = 1
            float inputs:roughness = 0.5
            token outputs:surface
        }
    }
}
)usda";
    const std::string how =
        "--spp 64 --adaptive off --guiding off --float-layers --layers bounce,lobe --lpe "
        "\"mirror=C<RS>L\" --lpe \"mirrordiff=C<RS>DL\" --stats s.json --splitting ";
    const image::Image whole = render(scene, how + "off"), divided = render(scene, how + "auto");
    const auto stats = nlohmann::json::parse(*read_file(w.path("s.json")));
    EXPECT_GT(stats["splitting"]["mean_branches"].get<double>(), 1.0) << stats["splitting"];
    for (const char* name : {"mirror", "mirrordiff", "specular_indirect", "diffuse_direct"}) {
        double a = 0, b = 0;
        for (const float v : layer(whole, name)) a += double(v);
        for (const float v : layer(divided, name)) b += double(v);
        fmt::print("{}: {:.2f} whole, {:.2f} divided\n", name, a, b);
        EXPECT_NEAR(a, b, 0.05 * a) << name;
    }
}

/// What is solved for is labeled like what paths find: a floor under a glass ball, lit through it.
TEST_F(LightPathLayers, CausticsKeepTheirLabelsHoweverTheyAreFound) {
    std::string scene = room(1, 1);
    scene.replace(scene.find("float inputs:width = 3"), 22, "float inputs:width = 0.5");
    scene.replace(scene.find("float inputs:height = 3"), 23, "float inputs:height = 0.5");
    const std::string how =
        "--adaptive off --guiding off --float-layers --layers bounce,lobe --lpe \"through=CDT+L\" "
        "--lpe \"mirrored=CDS+L\" --lpe \"rest=CD[RV].*<R>L\" ";
    const auto mean = [](const std::vector<float>& v) {
        double total = 0;
        for (const float x : v) total += double(x);
        return total / double(v.size());
    };
    const image::Image paths = render(scene, how + "--spp 1024"),
                       solved = render(scene, how + "--spp 128 --caustics manifold");
    for (const char* name : {"through", "mirrored", "diffuse_indirect"}) {
        const double expected = mean(layer(paths, name)), found = mean(layer(solved, name));
        fmt::print("{}: {:.5f} by paths, {:.5f} solved for\n", name, expected, found);
        EXPECT_GT(expected, 0.0);
        EXPECT_NEAR(found, expected, 0.05 * expected) << name;
    }
}

TEST_F(LightPathLayers, AreOneHoweverTheyWereMade) {
    w.write("s.usda", room(1, 1));
    const auto make = [&](const std::string& arguments, const std::string& name) {
        const CommandResult r = w.velatura(
            "render s.usda --res 24 12 --progress none -q --layers light,lobe --halves --lpe "
            "\"wet=C<R.'coat'>.*<L.'key'>\" " +
            arguments + " -o " + name);
        EXPECT_EQ(r.exit_code, 0) << r.output;
    };
    make("--samples 0:20", "whole.exr");
    make("--samples 0:20 --mode tile --threads 1", "tile.exr");
    EXPECT_EQ(w.hash("tile.exr"), w.hash("whole.exr"));
    make("--samples 0:9", "a.exr");
    make("--samples 9:20", "b.exr");
    ASSERT_EQ(w.comp("merge a.exr b.exr -o m.exr").exit_code, 0);
    EXPECT_EQ(w.hash("m.exr"), w.hash("whole.exr"));
    make("--samples 0:9", "r.exr");
    make("--samples 0:20 --resume", "r.exr");
    EXPECT_EQ(w.hash("r.exr"), w.hash("whole.exr"));
}

TEST_F(LightPathLayers, RenderVarsAskForThem) {
    const std::string vars = R"usda(
def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel products = </Render/Product>
    }
    def RenderProduct "Product"
    {
        rel orderedVars = [</Render/Wet>, </Render/b2_key>, </Render/depth>, </Render/color>,
            </Render/Bad>, </Render/Odd>, </Render/N>]
    }
    def RenderVar "Wet"
    {
        token sourceType = "lpe"
        string sourceName = "C<R.'coat'>L"
        string driver:parameters:aov:name = "wet_direct"
    }
    def RenderVar "b2_key"
    {
        token sourceType = "lpe"
        string sourceName = "C.{2}<L.'key'>"
    }
    def RenderVar "depth"
    {
        token dataType = "float"
    }
    def RenderVar "color"
    {
    }
    def RenderVar "Bad"
    {
        token sourceType = "lpe"
        string sourceName = "C<RD>L<"
    }
    def RenderVar "Odd"
    {
        token sourceType = "primvar"
        string sourceName = "odd"
    }
    def RenderVar "N"
    {
        token dataType = "normal3f"
    }
}
)usda";
    const image::Image image =
        render(room(1, 1, vars, "    renderSettingsPrimPath = \"/Render/Settings\""),
               "--spp 4 --float-layers --bounces 3 --lpe coat_again=\"C<R.'coat'>L\"");
    EXPECT_EQ(layer(image, "wet_direct"), layer(image, "coat_again"));
    const auto wet = layer(image, "wet_direct");
    EXPECT_GT(*std::max_element(wet.begin(), wet.end()), 0.0f);
    // The set's own layer of that name and expression is it
    EXPECT_NE(image.find("b2_key.R"), nullptr);
    EXPECT_EQ(image.find("b2_key_2.R"), nullptr);
    // Depth by Hydra's name for it
    ASSERT_NE(image.find("depth"), nullptr);
    for (size_t i = 0; i < image.data.pixel_count(); ++i)
        ASSERT_EQ(image.find("depth")->value(i), image.find("Z")->value(i));
    EXPECT_EQ(image.find("Bad.R"), nullptr);
    const CommandResult r = w.velatura("render s.usda --res 8 4 --spp 1 --progress none -o b.exr");
    EXPECT_NE(r.output.find("</Render/Bad>"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("column 8: expected > to close the event"), std::string::npos)
        << r.output;
    EXPECT_NE(r.output.find("render var Odd: no geometry has a primvar \"odd\""), std::string::npos)
        << r.output;
    EXPECT_EQ(
        w.velatura("render s.usda --strict --res 8 4 --spp 1 --progress none -o b.exr").exit_code,
        1);
}

/// The beauty and its alpha as RenderMan, Arnold and Hydra call them, under names of the scene's
/// own: the same values as the beauty, in channels of that name.
TEST_F(LightPathLayers, VarsOfTheBeautyHaveTheirOwnNames) {
    std::string vars, list;
    const std::vector<std::pair<std::string, std::string>> names = {
        {"Picture", "Ci"}, {"Arnold", "RGBA"}, {"Hydra", "color"}, {"cover", "alpha"}};
    for (const auto& [name, source] : names) {
        vars += fmt::format(
            "    def RenderVar \"{}\"\n    {{\n        string sourceName = \"{}\"\n    }}\n", name,
            source);
        list += fmt::format("{}</Render/{}>", list.empty() ? "" : ", ", name);
    }
    const image::Image image = render(
        room(1, 1,
             fmt::format("def Scope \"Render\"\n{{\n    def RenderSettings \"Settings\"\n    {{\n"
                         "        rel products = </Render/Product>\n    }}\n    def RenderProduct "
                         "\"Product\"\n    {{\n        rel orderedVars = [{}]\n    }}\n{}}}\n",
                         list, vars),
             "    renderSettingsPrimPath = \"/Render/Settings\""),
        "--spp 2 --float-layers --bounces 1");
    const std::vector<std::array<std::string, 2>> twins = {{"Picture.R", "R"},
                                                           {"Picture.B", "B"},
                                                           {"Arnold.G", "G"},
                                                           {"Hydra.R", "R"},
                                                           {"cover", "A"}};
    for (const auto& [channel, of] : twins) {
        const image::Channel* const found = image.find(channel);
        ASSERT_NE(found, nullptr) << channel;
        for (size_t i = 0; i < image.data.pixel_count(); ++i)
            ASSERT_EQ(found->value(i), image.find(of)->value(i)) << channel << " " << i;
    }
}

/// Names that files have for other things, that are too long or no names; the light is the same
/// under all of them.
TEST_F(LightPathLayers, NamesNeverClash) {
    const std::vector<std::string> names = {"b1",
                                            "b1_hA",
                                            "clamp_b1",
                                            "S_key",
                                            "S_key_rest",
                                            "U_key",
                                            "C_key",
                                            "sums3",
                                            "CryptoObject00",
                                            "7",
                                            "N",
                                            "variance",
                                            "R",
                                            "a_name_that_no_reader_takes_all_of_hA",
                                            "b1_halfA",
                                            "beauty",
                                            "deep",
                                            "beauty_hA",
                                            "dürer \\w"};
    std::string options;
    for (const std::string& name : names) options += fmt::format("--lpe \"{}=C.L\" ", name);
    for (const char* how : {"--halves --layers bounce,shadow,caster,data --exr-layout multipart",
                            "--clamp-direct 0.1 --halves --layers light,lobe",
                            "--resumable --cryptomatte object --layers none"}) {
        const image::Image image =
            render(small_scene(), fmt::format("--spp 4 {} {}", how, options));
        const Result<layers::LayerHeader> header = layers::read_layer_header(image);
        ASSERT_TRUE(header.has_value());
        size_t found = 0;
        for (const accumulate::LayerEntry& e : header->layers) {
            if (e.family != "paths") continue;
            ++found;
            EXPECT_EQ(layer(image, e.name), layer(image, "layer_U_key")) << e.name;
        }
        // b1_halfA is what b1_hA becomes: one layer of one expression
        EXPECT_EQ(found, names.size() - 1) << how;
    }
}

TEST_F(LightPathLayers, WrongOptionsAreUsageErrors) {
    w.write("s.usda", room(1, 1));
    for (const char* lpe : {"C<RD>L", "=CL", "x=C<RD", "x=C<L.'kay'>", "x=unoccluded;C.*L"}) {
        const CommandResult r =
            w.velatura(fmt::format("render s.usda --res 8 4 --spp 1 -o no.exr --lpe \"{}\"", lpe));
        EXPECT_EQ(r.exit_code, 2) << lpe << ": " << r.output;
    }
    EXPECT_FALSE(w.exists("no.exr"));
}

}  // namespace velatura::test
