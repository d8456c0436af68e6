// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake.h"

#include "compositor/bake_layer.h"
#include "compositor/test_stack.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

image::LightValues light(const std::string& path, double intensity, double exposure) {
    image::LightValues v;
    v.path = path;
    v.type = "RectLight";
    v.intensity = intensity;
    v.exposure = exposure;
    v.color = {1, 0.5, 0.25};
    return v;
}

/// The made-up film with values for its lights, `FillB` animated and `Sky` below an instance.
LayerStack make_stack(bool has_values = true) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = true;
    film::Film film({0, 0, 8, 8}, set);
    film::render(film, 0, 4);
    film::FileInfo info;
    if (has_values) {
        info.light_values = {light("/World/Key", 3, 1), light("/World/FillA", 2, 0),
                             light("/World/FillB", 5, -1), light("/World/Sky", 1, 0),
                             light("/World/Off", 1, 0)};
        info.light_values[2].varying = {"intensity", "color"};
        info.light_values[3].is_in_instance = true;
        info.light_values[4].shows_material = true;
    }
    const std::string path = film::temporary_file("bake.exr");
    EXPECT_TRUE(film.write(path, info).has_value());
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

const BakedLight* find(const Bake& bake, const std::string& path) {
    for (const BakedLight& l : bake.lights) {
        if (l.path == path) return &l;
    }
    return nullptr;
}

TEST(BakeLook, ValuesGoThroughTheFile) {
    const LayerStack stack = make_stack();
    ASSERT_EQ(stack.header().light_values.size(), 5u);
    EXPECT_EQ(stack.header().light_values[0], light("/World/Key", 3, 1));
    EXPECT_EQ(stack.header().light_values[2].varying,
              (std::vector<std::string>{"intensity", "color"}));
    EXPECT_TRUE(stack.header().light_values[3].is_in_instance);
    EXPECT_TRUE(stack.header().light_values[4].shows_material);
    const auto refused = bake_look(make_stack(false), {});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "no-light-values");
}

TEST(BakeLook, FactorsGoToIntensityStopsToExposureTintsToColour) {
    const auto bake = bake_look(
        make_stack(), look_of({{Gain, "key=2"}, {Gain, "key:all=+1.5st"}, {Tint, "key=1,.5,0"}}));
    ASSERT_TRUE(bake.has_value());
    ASSERT_EQ(bake->lights.size(), 1u);
    const BakedLight& key = bake->lights[0];
    EXPECT_EQ(key.intensity, 6.0);
    EXPECT_NEAR(key.exposure.value(), 2.5, 1e-6);
    EXPECT_EQ(key.color.value(), (std::array<double, 3>{1, 0.25, 0}));
    EXPECT_TRUE(bake->left.empty());
}

TEST(BakeLook, GainsOfALightMultiplyItsRadiance) {
    // Whatever inputs they end up in: colour × intensity × 2^exposure is the base times the gains
    const LayerStack stack = make_stack();
    Look look = look_of({{Gain, "key=3"}, {Kelvin, "key=4000"}, {Gain, "all=-2st"}});
    look.exposure_stops = 0.75f;
    const auto bake = bake_look(stack, look);
    ASSERT_TRUE(bake.has_value());
    const BakedLight& key = *find(*bake, "/World/Key");
    const image::LightValues& base = stack.header().light_values[0];
    const auto tint = kelvin_tint(4000);
    for (size_t c = 0; c < 3; ++c) {
        const double before = base.color[c] * base.intensity * std::exp2(base.exposure);
        const double after =
            key.color.value()[c] * key.intensity.value() * std::exp2(key.exposure.value());
        EXPECT_NEAR(after, before * 3 * double(tint[c]) * std::exp2(-1.25), 1e-5 * before);
    }
}

TEST(BakeLook, AnimationKeepsItsSamples) {
    const auto bake = bake_look(make_stack(), look_of({{Gain, "fill=4"}, {Tint, "fill=1,1,.5"}}));
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(find(*bake, "/World/FillA")->intensity, 8.0);
    const BakedLight& animated = *find(*bake, "/World/FillB");
    EXPECT_FALSE(animated.intensity.has_value());
    EXPECT_EQ(animated.exposure, 1.0);
    EXPECT_FALSE(animated.color.has_value());
    ASSERT_EQ(bake->left.size(), 1u);
    EXPECT_NE(bake->left[0].find("/World/FillB"), std::string::npos);
}

TEST(BakeLook, SolosMuteTheOthers) {
    const auto bake = bake_look(make_stack(), look_of({{Solo, "key:b1"}, {Solo, "sky"}}));
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(find(*bake, "/World/Key"), nullptr);
    EXPECT_EQ(find(*bake, "/World/FillA")->intensity, 0.0);
    EXPECT_EQ(find(*bake, "/World/FillB")->intensity, 0.0);
    ASSERT_EQ(bake->left.size(), 2u);
    EXPECT_NE(bake->left[0].find("--solo key:b1"), std::string::npos);
    EXPECT_NE(bake->left[1].find("emissive"), std::string::npos);
}

TEST(BakeLook, SetsOfRowsAreTheirMaster) {
    Look look = look_of({{Gain, "warm=2"}, {Mute, "mixed"}});
    look.rows = {{"warm", {"key", "fill", "key:all"}}, {"mixed", {"fill", "b2"}}};
    const auto bake = bake_look(make_stack(), look);
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(find(*bake, "/World/Key")->intensity, 6.0);
    EXPECT_EQ(find(*bake, "/World/FillA")->intensity, 0.0);
    ASSERT_EQ(bake->left.size(), 1u);
    EXPECT_NE(bake->left[0].find("--mute b2"), std::string::npos);
}

TEST(BakeLook, NamesWhatItLeaves) {
    const auto bake = bake_look(make_stack(), look_of({{Gain, "indirect=2"},
                                                       {Shadow, "key=.5"},
                                                       {Gain, "sky=2"},
                                                       {Mute, "emissive"},
                                                       {Gain, "off=2"}}));
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(bake->left.size(), 4u);
    EXPECT_EQ(bake->notes.size(), 1u);
    EXPECT_EQ(bake->lights.size(), 1u);
    EXPECT_EQ(bake->baked.controls.size(), 3u);
    Look matted = look_of({{Gain, "key=2"}});
    matted.controls[0].matte = "object:ball";
    EXPECT_EQ(bake_look(make_stack(), matted)->left.size(), 1u);
    const auto unknown = bake_look(make_stack(), look_of({{Gain, "moon=2"}}));
    ASSERT_FALSE(unknown.has_value());
    EXPECT_EQ(unknown.error().code, "unknown-name");
}

TEST(BakeLayer, IsOversAndComments) {
    Bake bake;
    bake.lights = {{"/A/key", 0.1, std::nullopt, std::nullopt},
                   {"/A", std::nullopt, -1.5, std::nullopt},
                   {"/B", std::nullopt, std::nullopt, std::array<double, 3>{1, 0, 0.25}}};
    bake.left = {"a line\nof two"};
    const auto text = bake_layer_text(bake, "shot.exr");
    ASSERT_TRUE(text.has_value());
    EXPECT_EQ(*text, R"(#usda 1.0
# A light mix of shot.exr as opinions over its lights; put it above the scene.
# not baked: a line of two

over "A"
{
    float inputs:exposure = -1.5
    over "key"
    {
        float inputs:intensity = 0.1
    }
}

over "B"
{
    color3f inputs:color = (1, 0, 0.25)
}
)");
    for (const char* path : {"", "A", "/", "/A//B", "/A/", "/9", "/A\"", "/A\n"}) {
        bake.lights[0].path = path;
        EXPECT_FALSE(bake_layer_text(bake, "").has_value()) << path;
    }
}

TEST(BakeLayer, StageMetadataWithoutSublayers) {
    const auto metadata = stage_metadata(
        "#usda 1.0\n# (comment)\n(\n    \"\"\"a \"text\" (of) ]\"\"\"\n    upAxis = \"Z\"\n    "
        "subLayers = [\n        @a)].usda@ (offset = 1),\n"
        "        @@@b@c.usda@@@\n    ]\n    customLayerData = {\n        string subLayers = "
        "\"x\"\n    }\n)\ndef \"A\" ( kind = \"x\" ) {}\n");
    ASSERT_TRUE(metadata.has_value());
    EXPECT_NE(metadata->find("\"\"\"a \"text\" (of) ]\"\"\""), std::string::npos);
    EXPECT_NE(metadata->find("upAxis = \"Z\""), std::string::npos);
    EXPECT_NE(metadata->find("string subLayers = \"x\""), std::string::npos);
    EXPECT_EQ(metadata->find(".usda"), std::string::npos);
    EXPECT_EQ(metadata->find("kind"), std::string::npos);
    EXPECT_EQ(*stage_metadata("#usda 1.0\ndef \"A\" ( kind = \"x\" ) {}\n"), "");
    EXPECT_FALSE(stage_metadata("#usda 1.0\n( upAxis = \"Z\"").has_value());
    EXPECT_FALSE(stage_metadata("PXR-USDC").has_value());
}

}  // namespace
}  // namespace velatura::compositor
