// SPDX-License-Identifier: Apache-2.0
// `mix --with-layers`: what a mixed file keeps of the file that it was made from.
#include "base/atomic_file.h"
#include "compositor/made_layers.h"
#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_job.h"
#include "compositor/noise/noise.h"
#include "compositor/test_stack.h"
#include "image/digest.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"
#include "layers/layer_check.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;
using image::ChannelType;

constexpr image::Window window{-3, 2, 20, 17};

std::string path_of(const std::string& name) {
    return film::temporary_file("layered_" + name);
}

/// All that a render may store.
LayerStack rendered(layers::Layout layout = layers::Layout::MultiPart, bool has_matrix = true) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = has_matrix;
    set.shadow_layers = set.halves = true;
    set.mattes = {true, true};
    set.data_aliases = {{"myZ", "Z"}, {"final", "beauty"}};
    film::Film film(window, set);
    film::render(film, 0, 8);
    film::FileInfo info;
    info.layout = layout;
    info.store_sums = true;
    info.matte_names = {film::test_objects(), {"only"}};
    const std::string path = path_of("rendered.exr");
    EXPECT_TRUE(film.write(path, info).has_value());
    auto stack = LayerStack::load(path);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

const Look& graded() {
    static const Look look = [] {
        Look l = look_of({{Gain, "indirect=+1.3st"},
                          {Shadow, "key=0.3"},
                          {Tint, "key=1,.9,.8"},
                          {Gain, "fill=2"},
                          {Mute, "sky"}});
        l.exposure_stops = 0.5f;
        return l;
    }();
    return look;
}

/// Through a file, as people have it.
LayerStack with_layers(const LayerStack& stack, const Look& look) {
    const auto plan = plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    const std::string path = path_of("mixed.exr");
    EXPECT_TRUE(layers::write_image_file(path, apply_mix(stack, *plan, look, true)).has_value());
    auto out = LayerStack::load(path, ForeignFiles::Plain);
    EXPECT_TRUE(out.has_value());
    return std::move(*out);
}

void expect_good(const LayerStack& stack) {
    const auto check = layers::check_layers(stack.image(), stack.header());
    EXPECT_TRUE(check.is_good()) << check.problems[0];
    for (const layers::FamilyClosure& c : check.closure) EXPECT_LE(c.measured, 1.0) << c.family;
}

void expect_same_beauty(const image::Image& a, const image::Image& b, float tolerance) {
    for (const char* name : {"R", "G", "B", "A"}) {
        const image::Channel *x = a.find(name), *y = b.find(name);
        ASSERT_TRUE(x && y);
        for (size_t i = 0; i < x->size(); ++i) {
            const float allowed = tolerance * (1.0f + std::abs(y->value(i)));
            ASSERT_LE(std::abs(x->value(i) - y->value(i)), allowed) << name << " " << i;
        }
    }
}

TEST(LayeredMix, DataAndMattesStayBitForBitWithTheirTypesAndManifests) {
    const LayerStack stack = rendered();
    const LayerStack mixed = with_layers(stack, graded());
    expect_good(mixed);
    size_t kept = 0;
    for (const accumulate::LayerEntry& e : stack.header().layers) {
        const bool is_data = e.family == "data" && e.name != "variance" && e.name != "final";
        if (!is_data && e.family != "cryptomatte") continue;
        for (const image::Part& part : stack.image().parts) {
            for (const image::Channel& c : part.channels) {
                if (c.name != e.name && !c.name.starts_with(e.name + ".")) continue;
                const image::Channel* now = mixed.image().find(c.name);
                ASSERT_TRUE(now) << c.name;
                EXPECT_EQ(now->type(), c.type()) << c.name;
                EXPECT_EQ(std::memcmp(now->bytes(), c.bytes(), c.byte_count()), 0) << c.name;
                ++kept;
            }
        }
    }
    // albedo N P st: 11, Z myZ primId instanceId sampleCount invalid: 6, two Cryptomattes of a
    // preview and 3 levels of 4 channels: 30
    EXPECT_EQ(kept, 47u);
    const auto before = layers::cryptomattes_of(stack.image()),
               after = layers::cryptomattes_of(mixed.image());
    ASSERT_EQ(after.size(), 2u);
    for (size_t m = 0; m < 2; ++m) {
        EXPECT_EQ(after[m].layer, before[m].layer);
        EXPECT_FALSE(after[m].names.empty());
        EXPECT_EQ(after[m].names, before[m].names);
    }
    // A mix within a matte of the mixed file
    Look matted = look_of({{Gain, "key=2"}});
    matted.controls[0].matte = "material:only";
    EXPECT_TRUE(plan_mix(mixed, matted).has_value());
    // The beauty under another name is the mixed one
    EXPECT_EQ(mixed.image().find("final.G")->data, mixed.image().find("G")->data);
    EXPECT_EQ(mixed.header().find("final")->digest.size(), 64u);
}

/// A mix with unit gains is the fold that defines the beauty; one with others is the same with and
/// without layers, but for the order in which lifted shadows are added.
TEST(LayeredMix, UnitGainsGiveItsBeautyBitForBit) {
    for (const auto layout :
         {layers::Layout::MultiPart, layers::Layout::SinglePart, layers::Layout::Split}) {
        for (const bool has_matrix : {true, false}) {
            const LayerStack stack = rendered(layout, has_matrix);
            Look unlifted = has_matrix ? graded() : look_of({{Gain, "key=1.3"}, {Mute, "sky"}});
            Look lifted = unlifted;
            std::erase_if(unlifted.controls, [](const Control& c) { return c.kind == Shadow; });
            if (!has_matrix) lifted.controls.push_back(look_of({{Shadow, "key=0.3"}}).controls[0]);
            for (const bool is_lifted : {false, true}) {
                const Look& look = is_lifted ? lifted : unlifted;
                const LayerStack mixed = with_layers(stack, look);
                expect_good(mixed);
                const image::Image again = apply_mix(mixed, *plan_mix(mixed, {}), {}, false);
                expect_same_beauty(again, mixed.image(), 0);
                const image::Image bare = apply_mix(stack, *plan_mix(stack, look), look, false);
                expect_same_beauty(bare, mixed.image(), is_lifted ? 1e-6f : 0.0f);
            }
        }
    }
}

/// b1' = g (b1 + x S) and S' = g (1 − x) S, so b1' + S' = g U: lifting the rest of the shadow of
/// the mixed file is the same as lifting all of it at once.
TEST(LayeredMix, WhatIsLeftOfAShadowCanStillBeLifted) {
    const LayerStack stack = rendered();
    const LayerStack mixed = with_layers(stack, graded());
    for (size_t c = 0; c < 3; ++c) {
        const image::Channel *lit = mixed.channel("b1_key", c), *left = mixed.channel("S_key", c),
                             *all = mixed.channel("U_key", c);
        ASSERT_TRUE(lit && left && all);
        const float tint[] = {1.0f, 0.9f, 0.8f};
        const float gain = std::exp2(0.5f) * tint[c];
        for (size_t i = 0; i < window.pixel_count(); ++i) {
            const float b1 = stack.channel("b1_key", c)->value(i),
                        s = stack.channel("S_key", c)->value(i);
            const float scale = 1e-6f * gain * (std::abs(b1) + std::abs(s));
            ASSERT_NEAR(lit->value(i), gain * (b1 + 0.3f * s), scale);
            ASSERT_NEAR(left->value(i), gain * 0.7f * s, scale);
            ASSERT_NEAR(all->value(i), gain * stack.channel("U_key", c)->value(i), scale);
        }
    }
    const Look rest = look_of({{Shadow, "key=1"}});
    Look whole = graded();
    for (Control& control : whole.controls)
        if (control.kind == Shadow) control = rest.controls[0];
    expect_same_beauty(apply_mix(mixed, *plan_mix(mixed, rest), rest, false),
                       apply_mix(stack, *plan_mix(stack, whole), whole, false), 1e-5f);
}

TEST(LayeredMix, CoarserFamiliesAreSumsOfWhatWasGained) {
    const LayerStack stack = rendered();
    const LayerStack mixed = with_layers(stack, graded());
    ASSERT_EQ(mixed.header().closure.size(), 3u);
    EXPECT_EQ(mixed.header().closure[0].family, "matrix");
    // A group of a mix without layers: everything else muted
    for (const auto& [layer, target] : {std::pair{"C_fill", "fill"}, {"b2", "b2"}}) {
        Look solo = graded();
        solo.controls.push_back(look_of({{Solo, target}}).controls[0]);
        std::erase_if(solo.controls, [&](const Control& c) {
            return c.kind == Shadow && std::string(target) != "key";
        });
        const image::Image alone = apply_mix(stack, *plan_mix(stack, solo), solo, false);
        for (size_t i = 0; i < window.pixel_count(); ++i)
            ASSERT_EQ(mixed.channel(layer, 1)->value(i), alone.find("G")->value(i)) << layer;
    }
}

/// relMSE of the mix from its own half images, which are gained as it is, and the same variance.
TEST(LayeredMix, ItsNoiseIsThatOfTheMix) {
    const LayerStack stack = rendered();
    const LayerStack mixed = with_layers(stack, graded());
    const auto before = noise::forecast_noise(stack, graded(), std::nullopt),
               after = noise::forecast_noise(mixed, {}, std::nullopt);
    ASSERT_TRUE(before.has_value());
    ASSERT_TRUE(after.has_value()) << after.error().message;
    EXPECT_NEAR(after->mix.value, before->mix.value, 1e-4 * before->mix.value);
    EXPECT_NEAR(after->rendered.value, after->mix.value, 1e-4 * after->mix.value);
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        double expected = 0;
        for (const char* c : {"R", "G", "B"}) {
            const double d = double(mixed.image().find(std::string("beauty_hA.") + c)->value(i)) -
                             double(mixed.image().find(std::string("beauty_hB.") + c)->value(i));
            expected += d * d / 12;
        }
        ASSERT_NEAR(mixed.image().find("variance")->value(i), expected, 1e-5 * expected + 1e-30);
    }
}

TEST(LayeredMix, AUnitLookKeepsEveryChannelAsItIs) {
    const LayerStack stack = rendered();
    const LayerStack mixed = with_layers(stack, {});
    expect_good(mixed);
    for (const image::Part& part : stack.image().parts) {
        for (const image::Channel& c : part.channels) {
            if (image::is_bookkeeping(c.name)) continue;
            const image::Channel* now = mixed.image().find(c.name);
            ASSERT_TRUE(now) << c.name;
            ASSERT_EQ(now->type(), c.type()) << c.name;
            ASSERT_EQ(std::memcmp(now->bytes(), c.bytes(), c.byte_count()), 0) << c.name;
        }
    }
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, {}), 1), "exact sums");
}

/// Twice a half is one; 1.3 times it is not.
TEST(LayeredMix, HalvesStayHalvesWhereNoValueChanges) {
    const LayerStack stack = rendered();
    const LayerStack twice = with_layers(stack, look_of({{Gain, "key=2"}}));
    EXPECT_EQ(twice.channel("b2_key", 0)->type(), ChannelType::Half);
    EXPECT_EQ(twice.header().find("b2_key")->type, "half");
    const LayerStack odd = with_layers(stack, look_of({{Gain, "key=1.3"}}));
    EXPECT_EQ(odd.channel("b2_key", 0)->type(), ChannelType::Float);
    EXPECT_EQ(odd.header().find("b2_key")->type, "float");
    EXPECT_EQ(odd.channel("b2_fill", 0)->type(), ChannelType::Half);
    EXPECT_EQ(odd.image().find("primId")->type(), ChannelType::Uint);
}

/// A file with casters and clamps, and a light path that no gain of rows can be said of.
LayerStack with_casters() {
    image::Image image = made_layers();
    for (const std::string& group : {std::string("key"), std::string("fill")}) {
        for (const char* c : {".R", ".G", ".B"}) {
            for (image::Channel& sum : image.parts[2].channels) {
                if (sum.name != "S_" + group + c) continue;
                auto& values = std::get<std::vector<float>>(sum.data);
                for (size_t i = 0; i < values.size(); ++i)
                    values[i] = made_value("S_" + group + "_tree" + c, i) +
                                made_value("S_" + group + "_rest" + c, i);
            }
        }
    }
    std::string layers = image.text(layers::layers_attribute);
    layers.pop_back();
    image.attributes[layers::layers_attribute] =
        layers +
        R"(,{"name":"spec","family":"paths","part":"others","type":"float","inSum":false}])";
    for (const char* c : {".R", ".G", ".B"}) {
        image.parts[2].channels.push_back(image::Channel::make(
            std::string("spec") + c, ChannelType::Float, image.data.pixel_count()));
    }
    auto stack = LayerStack::from_image(std::move(image));
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

TEST(LayeredMix, CastersAndClampsAreLessWhatWasGivenBack) {
    const LayerStack stack = with_casters();
    const Look look = look_of(
        {{Gain, "key=2"}, {Shadow, "key=0.25"}, {Caster, "key:tree=0.5"}, {Clamp, "all=0.5"}});
    const LayerStack mixed = with_layers(stack, look);
    for (size_t i = 0; i < mixed.image().data.pixel_count(); ++i) {
        const float tree = made_value("S_key_tree.G", i), rest = made_value("S_key_rest.G", i),
                    lit = made_value("b1_key.G", i), clamp = made_value("clamp_tail_key.G", i),
                    tail = made_value("tail_key.G", i);
        ASSERT_NEAR(mixed.channel("S_key_tree", 1)->value(i), 2 * 0.25f * tree, 1e-5);
        ASSERT_NEAR(mixed.channel("S_key_rest", 1)->value(i), 2 * 0.75f * rest, 1e-5);
        ASSERT_NEAR(mixed.channel("b1_key", 1)->value(i), 2 * (lit + 0.75f * tree + 0.25f * rest),
                    1e-5);
        ASSERT_NEAR(mixed.channel("tail_key", 1)->value(i), 2 * (tail + 0.5f * clamp), 1e-5);
        ASSERT_NEAR(mixed.channel("clamp_tail_key", 1)->value(i), 2 * 0.5f * clamp, 1e-5);
        // Black as rendered: all its light comes back
        ASSERT_NEAR(mixed.channel("b0_fill", 1)->value(i), 0.5f * made_value("clamp_b0_fill.G", i),
                    1e-5);
        // S_<group> is the fold of its casters, bit for bit
        ASSERT_EQ(
            mixed.channel("S_key", 1)->value(i),
            mixed.channel("S_key_tree", 1)->value(i) + mixed.channel("S_key_rest", 1)->value(i));
    }
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, look), 1), "1 layer of paths");
    EXPECT_FALSE(mixed.image().find("spec.R"));
    const Look rest = look_of({{Shadow, "key=1"}, {Clamp, "all=1"}});
    Look whole = look_of({{Gain, "key=2"}, {Shadow, "key=1"}, {Clamp, "all=1"}});
    expect_same_beauty(apply_mix(mixed, *plan_mix(mixed, rest), rest, false),
                       apply_mix(stack, *plan_mix(stack, whole), whole, false), 1e-5f);
}

/// Where everything has one gain, every layer has it.
TEST(LayeredMix, ALightPathFollowsAGainOfEverything) {
    const LayerStack stack = with_casters();
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, look_of({{Gain, "all=3"}})), 1), "");
    EXPECT_TRUE(with_layers(stack, look_of({{Gain, "all=3"}})).image().find("spec.R"));
}

/// A layer that is black may be lit by the shadow that is lifted from it.
TEST(LayeredMix, ABlackLayerTakesLiftedLight) {
    image::Image image = made_layers();
    take_out(image, {"b1_fill"});
    const auto stack = LayerStack::from_image(std::move(image));
    ASSERT_TRUE(stack.has_value());
    const LayerStack mixed = with_layers(*stack, look_of({{Shadow, "fill=1"}}));
    ASSERT_TRUE(mixed.channel("b1_fill", 0));
    EXPECT_EQ(mixed.channel("b1_fill", 0)->value(5), made_value("S_fill.R", 5));
    const image::Image again = apply_mix(mixed, *plan_mix(mixed, {}), {}, false);
    expect_same_beauty(again, mixed.image(), 0);
}

TEST(LayeredMix, OneGainOfAllScalesTheVarianceAndOthersLeaveItOut) {
    film::LayerSet set = film::test_layer_set();
    film::Film film(window, set);
    film::render(film, 0, 6);
    const LayerStack stack = through_file(film);
    Look look = look_of({{Gain, "all=3"}});
    look.exposure_stops = 1;
    const LayerStack mixed = with_layers(stack, look);
    for (size_t i = 0; i < window.pixel_count(); ++i)
        ASSERT_FLOAT_EQ(mixed.image().find("variance")->value(i),
                        36 * stack.image().find("variance")->value(i));
    const Look partial = look_of({{Gain, "key=3"}});
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, partial), 1),
              "variance, 4 layers of bounces");
    expect_good(with_layers(stack, partial));
}

TEST(LayeredMix, NaNCountsAsNothingAndIsTold) {
    image::Image image = made_layers();
    for (image::Channel& c : image.parts[1].channels) {
        if (c.name == "b1_key.G")
            std::get<std::vector<float>>(c.data)[40] = std::numeric_limits<float>::quiet_NaN();
    }
    const auto stack = LayerStack::from_image(std::move(image));
    std::vector<NotFiniteLayer> told;
    const image::Image mixed = apply_mix(*stack, *plan_mix(*stack, {}), {}, true, &told);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].layer, "b1_key");
    EXPECT_EQ(told[0].values, 1u);
    EXPECT_EQ(std::pair(told[0].x, told[0].y), std::pair(3, 1));
    EXPECT_EQ(mixed.find("b1_key.G")->value(40), 0.0f);
}

/// Of another renderer: names, data and mattes as they were, rows gained.
TEST(LayeredMix, AFileOfAnotherRendererKeepsItsChannels) {
    image::Image image =
        made_foreign({{"",
                       {"View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Combined.A",
                        "View.key.R", "View.key.G", "View.key.B", "View.Depth.Z", "View.Normal.X",
                        "View.Crypto00.R", "View.Crypto00.G", "user.mask"}}});
    image.attributes["cryptomatte/1234567/name"] = std::string("View.Crypto");
    image.attributes["cryptomatte/1234567/manif_file"] = std::string("names.json");
    const std::string path = path_of("foreign.exr"), mixed = path_of("elsewhere/mixed.exr");
    ASSERT_TRUE(image::write_exr(path, image).has_value());
    ASSERT_TRUE(write_file_atomically(path_of("names.json"), R"({"hero":"12345678"})"));
    std::filesystem::rename(path_of("names.json"),
                            std::filesystem::path(path).parent_path() / "names.json");
    std::filesystem::create_directories(std::filesystem::path(mixed).parent_path());
    MixJob job;
    job.output = mixed;
    job.look = look_of({{Gain, "key=2"}});
    job.with_layers = true;
    const auto warnings = mix_one(job, {path}, mixed, {}, 1);
    ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
    EXPECT_TRUE(warnings->empty());
    const auto after = LayerStack::load(mixed, ForeignFiles::Plain);
    ASSERT_TRUE(after.has_value()) << after.error().message;
    EXPECT_TRUE(after->is_plain());
    EXPECT_EQ(after->image().parts[0].channels.size(), 12u);
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const float key = made_value("View.key.G", i);
        ASSERT_EQ(after->image().find("View.key.G")->value(i), 2 * key);
        ASSERT_EQ(after->image().find("View.Combined.G")->value(i),
                  made_value("View.Combined.G", i) + key);
        for (const char* same : {"View.Depth.Z", "View.Crypto00.R", "user.mask"})
            ASSERT_EQ(after->image().find(same)->value(i), made_value(same, i));
    }
    // The manifest has come along
    const auto mattes = layers::cryptomattes_of(after->image(), mixed);
    ASSERT_EQ(mattes.size(), 1u);
    EXPECT_EQ(mattes[0].names, (std::vector<layers::MatteName>{{"hero", 0x12345678}}));
    const image::Image again = apply_mix(*after, *plan_mix(*after, {}), {}, false);
    EXPECT_EQ(again.find("G")->data, after->image().find("View.Combined.G")->data);
}

LayerStack foreign(const image::Image& image, const std::string& view = "") {
    auto stack = LayerStack::from_image(image, ForeignFiles::Plain, view);
    EXPECT_TRUE(stack.has_value()) << stack.error().message;
    return std::move(*stack);
}

/// A person who opens the file wants an image in R G B, whatever was summed for it.
TEST(LayeredMix, LightLayersAloneGetTheBeautyThatTheyAddUpTo) {
    const image::Image rows = made_foreign({{"",
                                             {"key.R", "key.G", "key.B", "key.A", "fill.R",
                                              "fill.G", "fill.B", "Z", "N.X", "N.Y", "N.Z"}}});
    const image::Image parts = made_foreign(
        {{"key", {"R", "G", "B", "A"}}, {"fill", {"R", "G", "B", "A"}}, {"depth", {"Z"}}});
    for (const image::Image& image : {rows, parts}) {
        const LayerStack stack = foreign(image);
        ASSERT_FALSE(stack.has_beauty());
        const Look look = look_of({{Gain, "key=2"}});
        const LayerStack mixed = with_layers(stack, look);
        ASSERT_TRUE(mixed.has_beauty());
        const image::Image bare = apply_mix(stack, *plan_mix(stack, look), look, false);
        for (const char* name : {"R", "G", "B", "A"}) {
            const image::Channel* of = mixed.image().parts[0].find(name);
            ASSERT_TRUE(of) << name;
            EXPECT_EQ(of->data, bare.find(name)->data) << name;
        }
        EXPECT_EQ(mixed.channel("key", 1)->value(7), 2 * stack.channel("key", 1)->value(7));
        EXPECT_EQ(mixed.channel("fill", 1)->value(7), stack.channel("fill", 1)->value(7));
        EXPECT_EQ(mixed.image().find("Z")->data, stack.image().find("Z")->data);
        const image::Image again = apply_mix(mixed, *plan_mix(mixed, {}), {}, false);
        EXPECT_EQ(again.find("G")->data, bare.find("G")->data);
    }
}

/// Sums of rows do not hold for rows with gains of their own.
TEST(LayeredMix, SumsOfRowsFollowOneGainOfAllAndAreLeftOutOfOthers) {
    const LayerStack stack =
        foreign(made_foreign({{"",
                               {"diffuse.R", "diffuse.G", "diffuse.B", "diffuse_direct.R",
                                "diffuse_direct.G", "diffuse_direct.B", "diffuse_indirect.R",
                                "diffuse_indirect.G", "diffuse_indirect.B"}}}));
    ASSERT_FALSE(stack.has_beauty());
    const Look one = look_of({{Gain, "diffuse_direct=2"}}), all = look_of({{Gain, "all=2"}});
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, one), 1), "diffuse");
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, all), 1), "");
    EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, {}), 1), "");
    EXPECT_FALSE(with_layers(stack, one).image().find("diffuse.G"));
    EXPECT_EQ(with_layers(stack, all).image().find("diffuse.G")->value(5),
              2 * stack.image().find("diffuse.G")->value(5));
    EXPECT_EQ(with_layers(stack, {}).image().find("diffuse.G")->value(5),
              stack.image().find("diffuse.G")->value(5));
}

/// Of the one channel Y, which a tint makes three.
TEST(LayeredMix, ShadesOfGrayStayOneChannelUntilTheyHaveColors) {
    const LayerStack stack =
        foreign(made_foreign({{"rgba", {"Y", "A"}}, {"key", {"Y"}}, {"depth", {"Z"}}}));
    const LayerStack brighter = with_layers(stack, look_of({{Gain, "key=2"}}));
    ASSERT_EQ(brighter.image().parts.size(), 3u);
    EXPECT_EQ(brighter.image().parts[1].channels.size(), 1u);
    EXPECT_EQ(brighter.channel("key", 0)->value(5), 2 * stack.channel("key", 0)->value(5));
    EXPECT_EQ(brighter.channel("rgba", 0)->value(5),
              stack.channel("rgba", 0)->value(5) + stack.channel("key", 0)->value(5));
    const Look red = look_of({{Tint, "key=1,0,0"}});
    const LayerStack tinted = with_layers(stack, red);
    EXPECT_EQ(tinted.image().parts[1].channels.size(), 3u);
    EXPECT_EQ(tinted.channel("key", 2)->value(5), 0.0f);
    expect_same_beauty(apply_mix(tinted, *plan_mix(tinted, {}), {}, false),
                       apply_mix(stack, *plan_mix(stack, red), red, false), 0);
}

image::OtherAttribute string_list(const std::vector<std::string>& strings) {
    image::OtherAttribute list{"stringvector", ""};
    for (const std::string& s : strings) {
        const auto length = int32_t(s.size());
        list.bytes.append(reinterpret_cast<const char*>(&length), 4);
        list.bytes += s;
    }
    return list;
}

/// The view that is mixed; the other is not, and would be told from it by its light.
TEST(LayeredMix, OfSeveralViewsTheOneThatIsMixedIsKept) {
    image::Image prefixed = made_foreign(
        {{"", {"R", "G", "B", "A", "Z", "right.R", "right.G", "right.B", "right.A", "right.Z"}}});
    prefixed.attributes["multiView"] = string_list({"left", "right"});
    image::Image parts = made_foreign({{"rgba.left", {"R", "G", "B", "A"}},
                                       {"rgba.right", {"R", "G", "B", "A"}},
                                       {"depth.right", {"Z"}}});
    for (size_t p = 0; p < 3; ++p)
        parts.parts[p].attributes["view"] = std::string(p == 0 ? "left" : "right");
    for (const image::Image& image : {prefixed, parts}) {
        const LayerStack stack = foreign(image, "right");
        const Look look = look_of({{Gain, "all=2"}});
        EXPECT_EQ(layers_not_stored(stack, *plan_mix(stack, look), 1), "view left");
        const LayerStack mixed = with_layers(stack, look);
        EXPECT_TRUE(mixed.views().empty());
        size_t channels = 0;
        for (const image::Part& part : mixed.image().parts) channels += part.channels.size();
        EXPECT_EQ(channels, 5u);
        EXPECT_EQ(mixed.channel("rgba", 1)->value(5), 2 * stack.channel("rgba", 1)->value(5));
        EXPECT_TRUE(mixed.image().find("Z"));
        EXPECT_EQ(mixed.image().text("view"), "right");
    }
}

/// One AOV in each file: parts of one.
TEST(LayeredMix, FilesThatAreMixedTogetherBecomePartsOfOne) {
    std::vector<std::string> paths;
    for (const char* name : {"beauty", "key", "fill"}) {
        paths.push_back(path_of(std::string("aov_") + name + ".exr"));
        image::Image image = made_foreign({{"", {"R", "G", "B", "A", "Z"}}});
        for (image::Channel& c : image.parts[0].channels)
            for (float& v : std::get<std::vector<float>>(c.data)) v *= float(paths.size());
        ASSERT_TRUE(image::write_exr(paths.back(), image).has_value());
    }
    MixJob job;
    job.output = path_of("aov_mixed.exr");
    job.look = look_of({{Gain, "key=2"}});
    job.with_layers = true;
    const auto warnings = mix_one(job, paths, job.output, {}, 1);
    ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
    const auto mixed = LayerStack::load(job.output, ForeignFiles::Plain);
    ASSERT_TRUE(mixed.has_value()) << mixed.error().message;
    ASSERT_EQ(mixed->image().parts.size(), 3u);
    const float g = made_value("G", 5);
    EXPECT_EQ(mixed->channel("rgba", 1)->value(5), g + 2 * g);
    EXPECT_EQ(mixed->channel("key", 1)->value(5), 4 * g);
    EXPECT_EQ(mixed->channel("fill", 1)->value(5), 3 * g);
    for (size_t p = 0; p < 3; ++p)
        EXPECT_EQ(mixed->image().parts[p].find("Z")->value(5), float(p + 1) * made_value("Z", 5));
    const image::Image again = apply_mix(*mixed, *plan_mix(*mixed, {}), {}, false);
    EXPECT_EQ(again.find("G")->value(5), g + 2 * g);
}

/// Channels that were taken out of a render: what is left is carried as far as it holds.
TEST(LayeredMix, LayersThatHaveLostChannelsAreNamed) {
    image::Image image = rendered().image();
    for (image::Part& part : image.parts)
        std::erase_if(part.channels, [](const image::Channel& c) {
            return c.name == "C_fill.G" || c.name == "P.Y" || c.name == "U_key.B" || c.name == "G";
        });
    const auto stack = LayerStack::from_image(std::move(image));
    ASSERT_TRUE(stack.has_value());
    const auto plan = plan_mix(*stack, graded());
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const std::string lost = layers_not_stored(*stack, *plan, 1);
    EXPECT_NE(lost.find("C_fill (channels are missing), U_key (channels are missing)"),
              std::string::npos)
        << lost;
    const LayerStack mixed = with_layers(*stack, graded());
    expect_good(mixed);
    EXPECT_FALSE(mixed.header().find("C_fill"));
    EXPECT_TRUE(mixed.image().find("P.X"));
    // The beauty is the sum of its layers, which are all there
    const LayerStack whole = rendered();
    expect_same_beauty(mixed.image(), with_layers(whole, graded()).image(), 0);
}

}  // namespace
}  // namespace velatura::compositor::mix
