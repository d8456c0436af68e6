// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/bake.h"

#include "compositor/bake/bake_layer.h"
#include "compositor/mix/mix_plan.h"
#include "compositor/test_stack.h"
#include "film/lobe_layers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::compositor::bake {
namespace {

using enum Control::Kind;

layers::LightValues light(const std::string& path, double intensity, double exposure) {
    layers::LightValues v;
    v.path = path;
    v.type = "RectLight";
    v.intensity = intensity;
    v.exposure = exposure;
    v.color = {1, 0.5, 0.25};
    return v;
}

/// The made-up film with values for its lights, `FillB` animated and `Sky` below an instance.
LayerStack make_stack(bool has_values = true, double key_intensity = 3, bool has_lobes = false) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = true;
    if (has_lobes) set.path_layers = film::lobes_of_matrix();
    film::Film film({0, 0, 8, 8}, set);
    film::render(film, 0, 4);
    film::FileInfo info;
    if (has_values) {
        info.light_values = {light("/World/Key", key_intensity, 1), light("/World/FillA", 2, 0),
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

TEST(BakeLook, FactorsGoToIntensityStopsToExposureTintsToColor) {
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

TEST(BakeLook, OpinionsWinOverConnectionsAndColorSpaces) {
    // A connection is stronger than a value, and the scene's colorSpace would count for the
    // baked color too, which is linear
    Bake bake;
    BakedLight& key = bake.lights.emplace_back();
    key.path = "/Key";
    key.intensity = 2;
    key.color = {1, 0.5, 0.25};
    key.connected = {"color"};
    key.has_color_space = true;
    const auto text = bake_layer_text(bake, "shot.exr");
    ASSERT_TRUE(text.has_value());
    for (const char* line :
         {"    float inputs:intensity = 2\n",
          "    color3f inputs:color = (1, 0.5, 0.25) (colorSpace = \"lin_rec709_scene\")\n",
          "    color3f inputs:color.connect = None\n"})
        EXPECT_NE(text->find(line), std::string::npos) << *text;
    EXPECT_EQ(text->find("intensity.connect"), std::string::npos);
    // The space is that of the file
    bake.color_space = "lin_ap1_scene";
    const auto aces = bake_layer_text(bake, "shot.exr");
    ASSERT_TRUE(aces.has_value());
    EXPECT_NE(aces->find("(1, 0.5, 0.25) (colorSpace = \"lin_ap1_scene\")"), std::string::npos);
}

TEST(BakeLook, GainsOfALightMultiplyItsRadiance) {
    // Whatever inputs they end up in: color × intensity × 2^exposure is the base times the gains
    const LayerStack stack = make_stack();
    Look look = look_of({{Gain, "key=3"}, {Kelvin, "key=4000"}, {Gain, "all=-2st"}});
    look.exposure_stops = 0.75f;
    const auto bake = bake_look(stack, look);
    ASSERT_TRUE(bake.has_value());
    const BakedLight& key = *find(*bake, "/World/Key");
    const layers::LightValues& base = stack.header().light_values[0];
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

/// What a look does to a group of the file, layer by layer.
std::vector<std::array<float, 3>> gains_of(const LayerStack& stack,
                                           const Look& look,
                                           const std::string& group) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value());
    const float exposure = std::exp2(look.exposure_stops);
    std::vector<std::array<float, 3>> gains;
    for (const mix::MixPlan::Term& term : plan->terms) {
        if (stack.header().find(term.layer)->group != group) continue;
        gains.push_back(term.gain);
        for (float& g : gains.back()) g *= exposure;
    }
    EXPECT_FALSE(gains.empty());
    return gains;
}

TEST(BakeLook, ItsRecordIsWhatWasBaked) {
    // Whole groups have the mix; those that lights cannot follow are as rendered; of fill one prim
    // could take the tint and the other not
    const LayerStack stack = make_stack();
    Look look = look_of({{Gain, "key=+2st"}, {Tint, "fill=1,.5,1"}, {Gain, "all=3"}});
    look.exposure_stops = 0.5f;
    const auto bake = bake_look(stack, look);
    ASSERT_TRUE(bake.has_value());
    const auto baked = gains_of(stack, bake->baked, "key"), wanted = gains_of(stack, look, "key");
    ASSERT_EQ(baked.size(), wanted.size());
    for (size_t i = 0; i < baked.size(); ++i)
        for (size_t c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(baked[i][c], wanted[i][c]);
    for (const char* group : {"sky", "emissive"}) {
        for (const auto& gain : gains_of(stack, bake->baked, group))
            EXPECT_EQ(gain, (std::array<float, 3>{1, 1, 1})) << group;
    }
    EXPECT_EQ(bake->partial, std::vector<std::string>{"fill"});
    EXPECT_EQ(bake->baked.exposure_stops, 0);
    const auto muted = bake_look(stack, look_of({{Gain, "key=2"}, {Mute, "key"}}));
    ASSERT_EQ(muted->baked.controls.size(), 1u);
    EXPECT_EQ(muted->baked.controls[0].kind, Mute);
}

TEST(BakeLook, NamesMeanWhatTheyMeanInAMix) {
    const LayerStack stack = make_stack();
    Look look = look_of({{Gain, "warm:all=2"}, {Gain, "warm:b1=2"}, {Mute, "env:all"}});
    look.rows = {{"warm", {"key", "fill"}}};
    const auto bake = bake_look(stack, look);
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(find(*bake, "/World/Key")->intensity, 6.0);
    EXPECT_EQ(find(*bake, "/World/FillA")->intensity, 4.0);
    // Two rows of the set, and the instanced dome
    ASSERT_EQ(bake->left.size(), 3u);
    EXPECT_NE(bake->left[0].find("--gain key:b1=2: "), std::string::npos) << bake->left[0];
    EXPECT_NE(bake->left[1].find("--gain fill:b1=2: "), std::string::npos) << bake->left[1];
    EXPECT_NE(bake->left[2].find("/World/Sky"), std::string::npos) << bake->left[2];
    EXPECT_EQ(bake_look(stack, look_of({{Gain, "key=2"}, {Mute, "shadow"}}))->left.size(), 1u);
}

TEST(BakeLook, KeysInStopsGoToTheExposure) {
    const LayerStack stack = make_stack();
    const Look look = look_of({{Gain, "key=0st@1,2st@13"}, {Gain, "fill=1@1,3@13"}});
    const auto bake = bake_look(stack, look_at(look, 7));
    ASSERT_TRUE(bake.has_value());
    const BakedLight& key = *find(*bake, "/World/Key");
    EXPECT_FALSE(key.intensity.has_value());
    EXPECT_NEAR(key.exposure.value(), 2, 1e-6);
    EXPECT_EQ(find(*bake, "/World/FillA")->intensity, 4.0);
    // A layer has one value for all frames: said for each
    ASSERT_EQ(bake->notes.size(), 2u);
    EXPECT_NE(bake->notes[0].find("--gain key=0st@1,2st@13: "), std::string::npos)
        << bake->notes[0];
}

TEST(BakeLook, LightsStayFinite) {
    const LayerStack stack = make_stack();
    for (const float exposure :
         {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
          std::numeric_limits<float>::quiet_NaN()}) {
        Look look;
        look.exposure_stops = exposure;
        const auto bake = bake_look(stack, look);
        ASSERT_FALSE(bake.has_value()) << exposure;
        EXPECT_EQ(bake.error().code, "bad-gain");
    }
    const auto product = bake_look(stack, look_of({{Gain, "key=1e19"}, {Gain, "all=1e19"}}));
    ASSERT_FALSE(product.has_value());
    EXPECT_EQ(product.error().code, "bad-gain");
    // A light that was bright to begin with
    const LayerStack bright = make_stack(true, 1e30);
    EXPECT_TRUE(bake_look(bright, look_of({{Gain, "key=1e6"}})).has_value());
    const auto beyond = bake_look(bright, look_of({{Gain, "key=1e10"}}));
    ASSERT_FALSE(beyond.has_value());
    EXPECT_NE(beyond.error().message.find("/World/Key"), std::string::npos);
}

TEST(BakeLook, AMatteThatIsNotThereIsNamedAsAnyOther) {
    Look look = look_of({{Gain, "key=2"}, {Gain, "fill=2"}});
    look.controls[0].matte = "/nowhere/matte.exr:M";
    const auto bake = bake_look(make_stack(), look);
    ASSERT_TRUE(bake.has_value());
    EXPECT_EQ(find(*bake, "/World/Key"), nullptr);
    ASSERT_EQ(bake->left.size(), 1u);
    EXPECT_NE(bake->left[0].find("limited to a matte"), std::string::npos);
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
    // What was named is in no look: surfaces that emit, lights below an instance
    ASSERT_EQ(bake->baked.controls.size(), 1u);
    EXPECT_EQ(bake->baked.controls[0].target, "off");
    Look matted = look_of({{Gain, "key=2"}});
    matted.controls[0].matte = "object:ball";
    EXPECT_EQ(bake_look(make_stack(), matted)->left.size(), 1u);
    const auto unknown = bake_look(make_stack(), look_of({{Gain, "moon=2"}}));
    ASSERT_FALSE(unknown.has_value());
    EXPECT_EQ(unknown.error().code, "unknown-name");
}

/// Lights have one strength for all lobes.
TEST(BakeLook, WhatIsOfOneLobeIsLeft) {
    const auto bake = bake_look(
        make_stack(true, 3, true),
        look_of({{Gain, "key=2"}, {Gain, "key:specular=3"}, {Mute, "coat"}, {Mute, "off:b2"}}));
    ASSERT_TRUE(bake.has_value()) << bake.error().message;
    EXPECT_EQ(bake->left.size(), 3u);
    for (const std::string& left : bake->left)
        EXPECT_NE(left.find("no gain per bounce or lobe"), std::string::npos) << left;
    ASSERT_EQ(bake->baked.controls.size(), 1u);
    EXPECT_EQ(bake->baked.controls[0].target, "key");
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
}  // namespace velatura::compositor::bake
