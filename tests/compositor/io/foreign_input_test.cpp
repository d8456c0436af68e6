// SPDX-License-Identifier: Apache-2.0
// What files of other renderers hold beside a beauty and its lights: data, deep parts, views of two
// eyes, no beauty at all, or one AOV in each file.
#include "compositor/inspect/diff.h"
#include "compositor/inspect/info.h"
#include "compositor/io/input_files.h"
#include "compositor/io/pass_names.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_job.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "image/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstring>
#include <filesystem>

namespace velatura::compositor {
namespace {

using enum Control::Kind;
using Names = std::vector<std::string>;

std::string path_of(const std::string& name) {
    return film::temporary_file("foreign_" + name);
}

Names rgb(const std::string& layer) {
    return layer.empty() ? Names{"R", "G", "B"} : Names{layer + ".R", layer + ".G", layer + ".B"};
}

Names joined(const std::vector<Names>& lists) {
    Names all;
    for (const Names& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
}

LayerStack plain(const image::Image& image, const std::string& view = "") {
    auto stack = LayerStack::from_image(image, ForeignFiles::Plain, view);
    EXPECT_TRUE(stack.has_value()) << stack.error().message;
    return std::move(*stack);
}

Names layers_of(const LayerStack& stack, const char* family) {
    Names names;
    for (const accumulate::LayerEntry& e : stack.header().layers)
        if (e.family == family) names.push_back(e.name);
    return names;
}

image::Image mixed(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    return mix::apply_mix(stack, *plan, look, false);
}

/// Of mix, as the command line is typed; the image is at `output`.
Outcome mix(const std::string& arguments, const std::string& output) {
    std::filesystem::remove(output);
    return run(fmt::format("{}/velatura-comp mix {} -o {}", VELATURA_BIN_DIR, arguments, output));
}

void write(const std::string& path, const image::Image& image) {
    const auto written = image::write_exr(path, image);
    ASSERT_TRUE(written.has_value()) << written.error().message;
}

TEST(PassNames, DataOfTheRenderersAreNoLight) {
    const std::vector<std::pair<const char*, Names>> renderers = {
        {"Cycles",
         {"ViewLayer.AO",
          "ViewLayer.Normal",
          "ViewLayer.Position",
          "ViewLayer.Vector",
          "ViewLayer.UV",
          "ViewLayer.Depth",
          "ViewLayer.Mist",
          "ViewLayer.IndexOB",
          "ViewLayer.IndexMA",
          "ViewLayer.DiffCol",
          "ViewLayer.GlossCol",
          "ViewLayer.TransCol",
          "ViewLayer.Denoising Albedo",
          "ViewLayer.Denoising Normal",
          "ViewLayer.Denoising Depth",
          "ViewLayer.Noisy Image",
          "ViewLayer.Debug Sample Count",
          "ViewLayer.CryptoObject00",
          "ViewLayer.Ambient Occlusion",
          "ViewLayer.Diffuse Color",
          "ViewLayer.Object Index",
          "ViewLayer.Guiding Color"}},
        {"Arnold",
         {"N",
          "P",
          "Pref",
          "Z",
          "ID",
          "object",
          "motionvector",
          "albedo",
          "diffuse_albedo",
          "specular_albedo",
          "denoise_albedo_noisy_albedo",
          "opacity",
          "shadow_matte",
          "AA_inv_density",
          "cputime",
          "raycount",
          "crypto_asset",
          "crypto_material00",
          "AO",
          "volume_opacity",
          "RGBA_denoise",
          "shadow_mask"}},
        {"Karma",
         {"N", "P", "Pz", "depth", "primid", "instanceid", "basecolor", "motionvectors", "hitPz",
          "primarysamples", "ShadingNormal", "CryptoMaterial", "beautyunshadowed", "st"}},
        {"RenderMan",
         {"Nn", "__Nworld", "__Pworld", "__depth", "__st", "sampleCount", "zfiltered", "dPdu",
          "motionFore", "motionBack", "facingratio", "incidenceangle", "normal_var", "albedo_mse",
          "diffuse_mse", "id", "cpuTime", "curvature", "Oi"}},
        {"V-Ray",
         {"VRayZDepth",           "VRayNormals",       "VRayBumpNormals", "VRayVelocity",
          "VRayRenderID",         "VRayObjectID",      "VRayMtlID",       "VRayDiffuseFilter",
          "VRayReflectionFilter", "VRayRawLighting",   "rawGI",           "VRaySamplerInfo",
          "VRayLightMix",         "CShading_LightMix", "key_light_raw",   "rim_light_denoised",
          "fill light variance",  "VRayWireColor",     "VRaySampleRate",  "VRayNoiseLevel",
          "VRayExtraTex_AO",      "multimatte_1",      "worldPositions",  "VRayAlpha",
          "effectsResult"}},
        {"MoonRay",
         {"heatmap", "weight", "normal", "depth", "motionvec", "St", "roughness", "visibility",
          "beauty_variance", "wireframe"}},
        {"Redshift and LuxCore",
         {"BumpNormals", "WorldPosition", "ObjectID", "PuzzleMatte", "DiffuseLightingRaw",
          "DiffuseFilter", "MotionVectors", "SHADING_NORMAL", "MATERIAL_ID", "SAMPLECOUNT",
          "DIRECT_SHADOW_MASK", "AVG_SHADING_NORMAL", "CONVERGENCE"}}};
    for (const auto& [renderer, names] : renderers)
        for (const std::string& name : names)
            EXPECT_EQ(pass_kind(name), PassKind::Data) << renderer << ": " << name;
}

TEST(PassNames, LightStaysLight) {
    for (const std::string name : {"key",
                                   "ViewLayer.DiffDir",
                                   "ViewLayer.GlossInd",
                                   "ViewLayer.Emit",
                                   "ViewLayer.Env",
                                   "ViewLayer.Combined_key",
                                   "ViewLayer.Combined_depth",
                                   "RGBA_key",
                                   "RGBA_ao",
                                   "RGBA_N",
                                   "diffuse_direct",
                                   "specular_indirect",
                                   "sss",
                                   "coat",
                                   "emission",
                                   "directdiffuse",
                                   "VRayLightSelect_uv",
                                   "VRayLighting",
                                   "VRayGlobalIllumination",
                                   "VRaySpecular",
                                   "lpe:C<RD>.+L",
                                   "C<L.'N'>",
                                   "C.*<L.'depth'>",
                                   "RADIANCE_GROUP_0",
                                   "caustics",
                                   "position_light",
                                   "AO light",
                                   "Light ID 1",
                                   "Light id 3 direct",
                                   "key_light_mask",
                                   "lamp index",
                                   "CShading_LightSelect_uv",
                                   "normandy",
                                   "shadow",
                                   "zed",
                                   "madrid",
                                   "idol",
                                   "unicorn",
                                   "nordic",
                                   "aorta",
                                   "12",
                                   "\xc3\xa9t\xc3\xa9"})
        EXPECT_EQ(pass_kind(name), PassKind::Light) << name;
    for (const std::string name : {"beauty", "rgba", "Ci", "ViewLayer.Combined", "RGB color", "C",
                                   "FinalImage", "CShading_Beauty"})
        EXPECT_EQ(pass_kind(name), PassKind::Beauty) << name;
}

TEST(ForeignInput, WhatIsNoLightIsListedAsData) {
    image::Image image = made_foreign({{"", joined({rgb(""),
                                                    rgb("key"),
                                                    rgb("AO"),
                                                    rgb("N"),
                                                    {"P.X", "P.Y", "P.Z", "Z", "mask"},
                                                    rgb("ids"),
                                                    rgb("beauty")})}});
    // By type: integers are ids, whatever they are called
    for (image::Channel& c : image.parts[0].channels) {
        if (c.name.starts_with("ids."))
            c = image::Channel::make(c.name, image::ChannelType::Uint, image.data.pixel_count());
    }
    // By what the part says of itself
    image.parts.push_back(made_foreign({{"warp", rgb("warp")}}).parts[0]);
    image.parts[1].attributes["colorInteropID"] = std::string("data");
    const LayerStack stack = plain(image);
    EXPECT_EQ(stack.group_names(), (Names{"key", "rest"}));
    EXPECT_EQ(layers_of(stack, "plain"), (Names{"key"}));
    EXPECT_EQ(layers_of(stack, "data"),
              (Names{"AO", "N", "P", "Z", "mask", "ids", "beauty", "warp"}));
    const std::string text = inspect::info_text(stack);
    EXPECT_NE(text.find("layer      ids                      data        uint"), std::string::npos)
        << text;
}

TEST(ForeignInput, InfoOfAFileWithoutOurHeaderIsJson) {
    const auto json = nlohmann::json::parse(
        inspect::info_json(plain(made_foreign({{"", rgb("")}}))), nullptr, false);
    ASSERT_FALSE(json.is_discarded());
    EXPECT_TRUE(json["closure"].is_null());
}

TEST(ForeignInput, LayersOfOneNameInTwoPartsAreTwoLayers) {
    const LayerStack stack =
        plain(made_foreign({{"rgba", rgb("")}, {"first", rgb("key")}, {"second", rgb("key")}}));
    EXPECT_EQ(stack.group_names(), (Names{"key", "key_2", "rest"}));
    EXPECT_EQ(stack.place("key", 0)->part, 1u);
    EXPECT_EQ(stack.place("key_2", 0)->part, 2u);
}

TEST(ForeignInput, GrayImagesAreTheirYInAllChannels) {
    const LayerStack stack = plain(made_foreign({{"", {"Y", "A"}}}));
    const image::Image image = mixed(stack, {});
    for (const char* c : {"R", "G", "B"})
        for (size_t i = 0; i < 40; ++i) ASSERT_EQ(image.find(c)->value(i), made_value("Y", i));
}

/// (b) Without a beauty the rows are all there is: their sum, in the order of the file, is it.
TEST(ForeignInput, LightWithoutABeautyIsItsSum) {
    const LayerStack stack =
        plain(made_foreign({{"", joined({rgb("key"), {"key.A"}, rgb("fill"), rgb("AO"), {"Z"}})}}));
    EXPECT_FALSE(stack.has_beauty());
    EXPECT_EQ(stack.group_names(), (Names{"key", "fill"}));
    ASSERT_EQ(stack.notes().size(), 1u);
    EXPECT_EQ(stack.notes()[0], "no beauty; using the sum of its 2 light layers");
    const image::Image unit = mixed(stack, {}), gained = mixed(stack, look_of({{Gain, "key=3"}})),
                       solo = mixed(stack, look_of({{Solo, "fill"}}));
    for (size_t i = 0; i < 100; ++i) {
        const float key = made_value("key.G", i), fill = made_value("fill.G", i);
        ASSERT_EQ(unit.find("G")->value(i), key + fill);
        ASSERT_EQ(gained.find("G")->value(i), 3.0f * key + fill);
        ASSERT_EQ(solo.find("G")->value(i), fill);
        ASSERT_EQ(unit.find("A")->value(i), made_value("key.A", i));
    }
    // Shares are those of the sum
    EXPECT_NE(inspect::info_text(stack).find("no beauty; using the sum"), std::string::npos);
    EXPECT_EQ(inspect::info_text(stack).find("– %"), std::string::npos)
        << inspect::info_text(stack);
}

/// Parts of other programs without a name that says beauty: two lights, and neither is the whole.
TEST(ForeignInput, PartsOfLightAreASum) {
    const LayerStack two = plain(made_foreign({{"key", rgb("")}, {"fill", rgb("")}}));
    EXPECT_EQ(two.group_names(), (Names{"key", "fill"}));
    EXPECT_FALSE(two.has_beauty());
    // One part is the image, whatever it is called
    EXPECT_TRUE(plain(made_foreign({{"main", rgb("")}, {"N", rgb("")}})).has_beauty());
    // A total is not added to its parts, nor the light that shadows took
    const LayerStack arnold =
        plain(made_foreign({{"", joined({rgb("diffuse"), rgb("diffuse_direct"),
                                         rgb("diffuse_indirect"), rgb("shadow")})}}));
    EXPECT_EQ(arnold.group_names(), (Names{"diffuse_direct", "diffuse_indirect"}));
    EXPECT_NE(arnold.notes()[0].find("without diffuse, shadow"), std::string::npos)
        << arnold.notes()[0];
}

/// A part of deep scanlines, then one of flat ones with made values.
void write_deep_and_flat(const std::string& path, bool has_flat) {
    constexpr int width = 37, height = 21;
    std::vector<Imf::Header> headers;
    Imf::Header deep(width, height);
    deep.setName("deep");
    deep.setType(Imf::DEEPSCANLINE);
    deep.compression() = Imf::ZIPS_COMPRESSION;
    deep.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    headers.push_back(deep);
    if (has_flat) {
        Imf::Header flat(width, height);
        flat.setName("rgba");
        flat.setType(Imf::SCANLINEIMAGE);
        for (const std::string& c : joined({rgb(""), rgb("key")}))
            flat.channels().insert(c, Imf::Channel(Imf::FLOAT));
        headers.push_back(flat);
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), int(headers.size()));
    std::vector<unsigned> counts(size_t(width) * height, 1);
    std::vector<float> z(counts.size(), 2.0f);
    std::vector<float*> pointers;
    for (float& v : z) pointers.push_back(&v);
    Imf::DeepFrameBuffer samples;
    samples.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()),
                                              sizeof(unsigned), sizeof(unsigned) * width));
    samples.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.data()),
                                       sizeof(float*), sizeof(float*) * width, sizeof(float)));
    Imf::DeepScanLineOutputPart deep_part(file, 0);
    deep_part.setFrameBuffer(samples);
    deep_part.writePixels(height);
    if (!has_flat) return;
    image::Image flat = made_foreign({{"", joined({rgb(""), rgb("key")})}});
    Imf::FrameBuffer buffer;
    for (image::Channel& c : flat.parts[0].channels)
        buffer.insert(c.name, Imf::Slice(Imf::FLOAT, static_cast<char*>(c.bytes()), sizeof(float),
                                         sizeof(float) * width));
    Imf::OutputPart flat_part(file, 1);
    flat_part.setFrameBuffer(buffer);
    flat_part.writePixels(height);
}

/// (c)
TEST(ForeignInput, TheFlatPartOfAFileWithDeepOnesIsUsed) {
    const std::string path = path_of("deep_flat.exr"), output = path_of("deep_flat_mix.exr");
    write_deep_and_flat(path, true);
    const Outcome done = mix(path + " --gain key=2", output);
    EXPECT_EQ(done.code, 0) << done.output;
    EXPECT_NE(done.output.find("part deep skipped: deep data are not read"), std::string::npos)
        << done.output;
    const auto image = image::read_exr(output);
    ASSERT_TRUE(image.has_value());
    for (size_t i = 0; i < 100; ++i)
        ASSERT_EQ(image->find("B")->value(i), made_value("B", i) + made_value("key.B", i));
    write_deep_and_flat(path, false);
    const Outcome refused = mix(path, output);
    EXPECT_EQ(refused.code, 1);
    EXPECT_NE(refused.output.find("deep data only"), std::string::npos) << refused.output;
}

image::OtherAttribute string_list(const Names& strings) {
    image::OtherAttribute list{"stringvector", ""};
    for (const std::string& s : strings) {
        const auto length = int32_t(s.size());
        list.bytes.append(reinterpret_cast<const char*>(&length), 4);
        list.bytes += s;
    }
    return list;
}

struct StereoFile {
    const char* what;
    image::Image image;
    /// Full names of R of the beauty and of `key`, left and right.
    std::array<std::array<const char*, 2>, 2> names;
    std::array<size_t, 2> parts = {0, 0};
};

std::vector<StereoFile> stereo_files() {
    std::vector<StereoFile> files;
    StereoFile& prefixes = files.emplace_back();
    prefixes.what = "multiView, names as OpenEXR has them";
    prefixes.image = made_foreign(
        {{"", joined({rgb(""), rgb("right"), rgb("key.left"), rgb("key.right"), {"Z"}})}});
    prefixes.image.attributes["multiView"] = string_list({"left", "right"});
    prefixes.names = {{{"R", "key.left.R"}, {"right.R", "key.right.R"}}};
    StereoFile& first = files.emplace_back();
    first.what = "multiView, the view first, and a layer of the first view without it";
    first.image =
        made_foreign({{"", joined({rgb(""), rgb("right"), rgb("key"), rgb("right.key")})}});
    first.image.attributes["multiView"] = string_list({"left", "right"});
    first.names = {{{"R", "key.R"}, {"right.R", "right.key.R"}}};
    StereoFile& parts = files.emplace_back();
    parts.what = "parts with an attribute view";
    parts.image = made_foreign({{"rgba.left", rgb("")},
                                {"rgba.right", rgb("")},
                                {"key.left", rgb("key")},
                                {"key.right", rgb("key")}});
    for (size_t p = 0; p < 4; ++p)
        parts.image.parts[p].attributes["view"] = std::string(p % 2 == 0 ? "left" : "right");
    for (size_t p = 1; p < 4; p += 2) {
        for (image::Channel& c : parts.image.parts[p].channels)
            for (float& v : std::get<std::vector<float>>(c.data)) v += 1.0f;
    }
    parts.names = {{{"R", "key.R"}, {"R", "key.R"}}};
    parts.parts = {0, 1};
    return files;
}

/// (d)
TEST(ForeignInput, OneEyeAtATime) {
    for (const StereoFile& file : stereo_files()) {
        SCOPED_TRACE(file.what);
        const std::string path = path_of("stereo.exr"), output = path_of("stereo_mix.exr");
        write(path, file.image);
        for (const bool is_right : {false, true}) {
            const Outcome done =
                mix(path + " --gain key=2" + (is_right ? " --stereo right" : ""), output);
            ASSERT_EQ(done.code, 0) << done.output;
            const bool is_told = done.output.find("using left;") != std::string::npos;
            EXPECT_EQ(is_told, !is_right) << done.output;
            const auto image = image::read_exr(output);
            ASSERT_TRUE(image.has_value());
            // Of the other eye nothing
            EXPECT_EQ(image->parts[0].channels.size(), 3u);
            EXPECT_EQ(image->attributes.count("multiView"), 0u);
            EXPECT_EQ(image->text("view"), is_right ? "right" : "left");
            const auto& names = file.names[is_right];
            const float more = file.parts[1] == 1 && is_right ? 1.0f : 0.0f;
            for (size_t i = 0; i < 100; ++i)
                ASSERT_EQ(image->find("R")->value(i),
                          made_value(names[0], i) + more + (made_value(names[1], i) + more));
        }
        const auto stack = LayerStack::load(path, ForeignFiles::Plain, "right");
        ASSERT_TRUE(stack.has_value());
        EXPECT_EQ(stack->group_names(), (Names{"key", "rest"}));
        EXPECT_NE(inspect::info_text(*stack).find("views      left right (this is right)"),
                  std::string::npos);
        const Outcome unknown = mix(path + " --stereo middle", output);
        EXPECT_EQ(unknown.code, 2) << unknown.output;
        EXPECT_NE(unknown.output.find("no view 'middle'; the file has left right"),
                  std::string::npos)
            << unknown.output;
    }
}

TEST(ForeignInput, EyesByThePartsNamesAlone) {
    const image::Image eyes = made_foreign({{"left", rgb("")}, {"right", rgb("")}});
    EXPECT_EQ(plain(eyes, "right").place("rgba", 0)->part, 1u);
    EXPECT_EQ(plain(eyes).place("rgba", 0)->part, 0u);
    // Two lights beside a beauty are lights
    const LayerStack lights =
        plain(made_foreign({{"rgba", rgb("")}, {"left", rgb("")}, {"right", rgb("")}}));
    EXPECT_EQ(lights.group_names(), (Names{"left", "right", "rest"}));
    EXPECT_EQ(LayerStack::from_image(made_foreign({{"", rgb("")}}), ForeignFiles::Plain, "left")
                  .error()
                  .code,
              "unknown-view");
}

/// Channels of one name in two parts are compared each with its own.
TEST(Diff, PartsMayHaveTheSameNames) {
    const image::Image a =
        made_foreign({{"rgba", rgb("")}, {"left", rgb("")}, {"key", rgb("key")}});
    image::Image b = a;
    for (float& v : std::get<std::vector<float>>(b.parts[1].channels[0].data)) v += 1;
    EXPECT_TRUE(inspect::compare(a, a)->is_equal);
    EXPECT_TRUE(inspect::compare(b, b)->is_equal);
    const auto difference = inspect::compare(b, a);
    ASSERT_TRUE(difference.has_value());
    EXPECT_FALSE(difference->is_equal);
    for (const inspect::LayerDifference& d : difference->layers)
        EXPECT_FLOAT_EQ(float(d.largest), d.layer == "left rgba" ? 1.0f : 0.0f) << d.layer;
    EXPECT_EQ(difference->layers.size(), 3u);
    const image::Image apart = inspect::difference_image(b, a);
    EXPECT_EQ(apart.parts[0].channels.size(), 9u);
    ASSERT_TRUE(apart.find("left R"));
    EXPECT_FLOAT_EQ(apart.find("left R")->value(3), 1.0f);
}

TEST(InputFiles, AreRowsByWhatTellsTheirNamesApart) {
    const auto names = [](const Names& paths) { return names_of_files(paths); };
    EXPECT_EQ(names({"key.exr", "fill.exr"}), (Names{"key", "fill"}));
    EXPECT_EQ(names({"out/shot_key.0007.exr", "out/shot_fill.0007.exr"}), (Names{"key", "fill"}));
    EXPECT_EQ(names({"shot_v2_key_left.exr", "shot_v2_key_right.exr"}), (Names{"left", "right"}));
    EXPECT_EQ(names({"a/key/shot.exr", "a/fill/shot.exr"}), (Names{"key", "fill"}));
    EXPECT_EQ(names({"shot.exr", "shot_key.exr", "shot_fill.exr"}), (Names{"", "key", "fill"}));
    EXPECT_EQ(names({"shot.0001.exr", "shot.key.0001.exr"}), (Names{"", "key"}));
    EXPECT_EQ(names({"keylight.exr", "keyrim.exr"}), (Names{"keylight", "keyrim"}));
    EXPECT_EQ(names({"s_rim_a.exr", "s_rim_b_a.exr"}), (Names{"", "b"}));
    EXPECT_EQ(names({"x.exr", "x.exr"}), (Names{"x", "x"}));
    EXPECT_TRUE(are_frames({"s.0001.exr", "s.0002.exr"}));
    EXPECT_TRUE(are_frames({"d/s0001.exr", "d/s0002.exr", "d/s0003.exr"}));
    EXPECT_FALSE(are_frames({"light_1.exr", "light_2.exr"}));
    EXPECT_FALSE(are_frames({"key.0001.exr", "fill.0001.exr"}));
    EXPECT_FALSE(are_frames({"s.0001.exr"}));
}

class Several : public testing::Test {
  protected:
    static std::string at(const std::string& name) { return path_of("several_" + name); }

    static void write_made(const std::string& name,
                           const std::string& values,
                           const image::Window& window = {0, 0, 37, 21}) {
        image::Image image = made_foreign({{"", {"R", "G", "B"}}});
        image.data = window;
        for (image::Channel& c : image.parts[0].channels) {
            const std::string channel = values + "." + c.name;
            c = image::Channel::make(c.name, image::ChannelType::Float, window.pixel_count());
            auto& v = std::get<std::vector<float>>(c.data);
            for (size_t i = 0; i < v.size(); ++i) v[i] = made_value(channel, i);
        }
        write(at(name), image);
    }
};

/// (e)
TEST_F(Several, FilesAreRowsOfOneMix) {
    write_made("s_key.exr", "key");
    write_made("s_fill.exr", "fill");
    write_made("s_AO.exr", "AO");
    const std::string output = at("mix.exr"), inputs = at("s_key.exr") + " " + at("s_fill.exr");
    const Outcome done = mix(inputs + " " + at("s_AO.exr") + " --gain key=2", output);
    ASSERT_EQ(done.code, 0) << done.output;
    EXPECT_NE(done.output.find("no beauty; using the sum of its 2 light layers"), std::string::npos)
        << done.output;
    const auto image = image::read_exr(output);
    ASSERT_TRUE(image.has_value());
    for (size_t i = 0; i < 100; ++i)
        ASSERT_EQ(image->find("R")->value(i),
                  2.0f * made_value("key.R", i) + made_value("fill.R", i));
    // With a beauty they are what it is made of, and `rest` is left
    write_made("s.exr", "whole");
    const Outcome whole = mix(at("s.exr") + " " + inputs + " --gain key=2 --mute rest", output);
    ASSERT_EQ(whole.code, 0) << whole.output;
    const auto rest = image::read_exr(output);
    for (size_t i = 0; i < 100; ++i)
        ASSERT_EQ(rest->find("R")->value(i),
                  2.0f * made_value("key.R", i) + made_value("fill.R", i));
    ASSERT_EQ(mix(at("s.exr") + " " + inputs, output).code, 0);
    EXPECT_EQ(image::read_exr(output)->find("G")->value(7), made_value("whole.G", 7));
    const Outcome unknown = mix(inputs + " --gain rim=2", output);
    EXPECT_EQ(unknown.code, 2);
    EXPECT_NE(unknown.output.find("groups: key fill"), std::string::npos) << unknown.output;
}

TEST_F(Several, OverOtherWindowsArePlacedAndOtherImagesRefused) {
    write_made("w_key.exr", "key");
    write_made("w_fill.exr", "fill", {10, 5, 20, 12});
    const std::string output = at("mix.exr"), inputs = at("w_key.exr") + " " + at("w_fill.exr");
    ASSERT_EQ(mix(inputs, output).code, 0);
    const auto image = image::read_exr(output);
    const image::Window own{10, 5, 20, 12};
    for (const auto& [x, y] : {std::pair{0, 0}, {10, 5}, {19, 11}, {20, 11}, {10, 12}}) {
        const float fill = own.contains(x, y) ? made_value("fill.R", own.index(x, y)) : 0.0f;
        EXPECT_EQ(image->find("R")->value(image->data.index(x, y)),
                  made_value("key.R", image->data.index(x, y)) + fill);
    }
    image::Image other = made_foreign({{"", rgb("")}});
    other.display = {0, 0, 64, 64};
    write(at("w_rim.exr"), other);
    const Outcome refused = mix(inputs + " " + at("w_rim.exr"), output);
    EXPECT_EQ(refused.code, 2) << refused.output;
    EXPECT_NE(refused.output.find("w_rim.exr has 64×64"), std::string::npos) << refused.output;
    other.display = {0, 0, 37, 21};
    other.attributes["chromaticities"] =
        image::Chromaticities{.713f, .293f, .165f, .83f, .128f, .044f, .32168f, .33767f};
    write(at("w_rim.exr"), other);
    const Outcome colors = mix(inputs + " " + at("w_rim.exr"), output);
    EXPECT_EQ(colors.code, 2);
    EXPECT_NE(colors.output.find("different colors"), std::string::npos) << colors.output;
    EXPECT_EQ(mix(inputs + " " + at("w_rim.exr") + " --input-space lin_rec709", output).code, 0);
}

TEST_F(Several, SequencesGoFrameByFrameAndFramesAreNoAovs) {
    for (const char* frame : {"0003", "0004"}) {
        for (const char* light : {"key", "fill"})
            write_made(fmt::format("q_{}.{}.exr", light, frame), light + std::string(frame));
    }
    const std::string output = at("q_mix.####.exr"), key = at("q_key.####.exr"),
                      fill = at("q_fill.####.exr");
    const Outcome done =
        mix(fmt::format("'{}' '{}' --gain fill=2", key, fill), fmt::format("'{}'", output));
    ASSERT_EQ(done.code, 0) << done.output;
    for (const char* frame : {"0003", "0004"}) {
        const auto image = image::read_exr(at(fmt::format("q_mix.{}.exr", frame)));
        ASSERT_TRUE(image.has_value());
        for (size_t i = 0; i < 100; ++i)
            ASSERT_EQ(image->find("R")->value(i),
                      made_value(fmt::format("key{}.R", frame), i) +
                          2.0f * made_value(fmt::format("fill{}.R", frame), i));
    }
    std::filesystem::remove(at("q_fill.0004.exr"));
    const Outcome gap = mix(fmt::format("'{}' '{}'", key, fill), fmt::format("'{}'", output));
    EXPECT_EQ(gap.code, 1);
    EXPECT_NE(gap.output.find("q_fill.0004.exr not found"), std::string::npos) << gap.output;
    const Outcome frames = mix(at("q_key.0003.exr") + " " + at("q_key.0004.exr"), at("mix.exr"));
    EXPECT_EQ(frames.code, 2);
    EXPECT_NE(frames.output.find("look like frames of one sequence"), std::string::npos)
        << frames.output;
}

/// A second program adds the same files up.
TEST_F(Several, IsTheSumOfOiiotool) {
    if (std::system("oiiotool --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no oiiotool";
    for (const char* light : {"key", "fill", "rim"})
        write_made(fmt::format("o_{}.exr", light), light);
    const std::string key = at("o_key.exr"), fill = at("o_fill.exr"), rim = at("o_rim.exr");
    ASSERT_EQ(mix(fmt::format("{} {} {}", key, fill, rim), at("mix.exr")).code, 0);
    const Outcome sum = run(
        fmt::format("oiiotool {} {} --add {} --add -d float -o {}", key, fill, rim, at("sum.exr")));
    ASSERT_EQ(sum.code, 0) << sum.output;
    const auto a = image::read_exr(at("mix.exr")), b = image::read_exr(at("sum.exr"));
    for (const char* c : {"R", "G", "B"}) EXPECT_EQ(a->find(c)->data, b->find(c)->data) << c;
}

}  // namespace
}  // namespace velatura::compositor
