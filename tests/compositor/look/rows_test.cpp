// SPDX-License-Identifier: Apache-2.0
// Rows of the mixer: casters, clamps, mattes, sets of rows, names that a file lacks.
#include "compositor/made_layers.h"
#include "compositor/mix/fit_look.h"
#include "compositor/mix/mix.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"
#include "layers/layer_check.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <functional>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

const LayerStack& made_stack() {
    static const LayerStack stack = *LayerStack::from_image(made_layers());
    return stack;
}

image::Image mixed(const LayerStack& stack, const Look& look) {
    const auto plan = mix::plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    return mix::apply_mix(stack, *plan, look, false);
}

/// Compares every pixel, bit for bit, with a formula of the pixel.
void expect_pixels(const image::Image& image,
                   const char* channel,
                   const std::function<float(size_t)>& expected) {
    const image::Channel* c = image.find(channel);
    ASSERT_NE(c, nullptr);
    for (size_t i = 0; i < c->size(); ++i)
        ASSERT_EQ(std::bit_cast<uint32_t>(c->value(i)), std::bit_cast<uint32_t>(expected(i))) << i;
}

float fold(const std::vector<float>& terms) {
    float sum = 0.0f;
    for (const float t : terms) sum += t;
    return sum;
}

TEST(Rows, CasterLiftsItsShareOfTheShadow) {
    const LayerStack& stack = made_stack();
    const auto lifted = mixed(stack, look_of({{Caster, "key:tree=0.5"}}));
    expect_pixels(lifted, "G", [&](size_t i) {
        return stack.image().find("G")->value(i) + 0.5f * made_value("S_key_tree.G", i);
    });
    // The gain of the light's direct light goes for its lifted shadows as well
    const auto all =
        mix::plan_mix(stack, look_of({{Caster, "all:tree=1"}, {Gain, "fill:b1=0.25"}}));
    ASSERT_TRUE(all.has_value());
    ASSERT_EQ(all->shadow_terms.size(), 2u);
    EXPECT_EQ(all->shadow_terms[0].layer, "S_fill_tree");
    EXPECT_EQ(all->shadow_terms[0].gain[0], 0.25f);
    EXPECT_EQ(all->shadow_terms[1].gain[0], 1.0f);
    const auto unknown = mix::plan_mix(stack, look_of({{Caster, "key:tee=0.5"}}));
    EXPECT_EQ(unknown.error().code, "unknown-name");
    EXPECT_NE(unknown.error().message.find("did you mean 'tree'"), std::string::npos);
    EXPECT_EQ(parse_control(Caster, "key=0.5").error().code, "bad-gain");
    // The name of one shadow where those of a light are due
    const auto shadow = mix::plan_mix(stack, look_of({{Shadow, "key:tree=0.5"}}));
    ASSERT_FALSE(shadow.has_value());
    EXPECT_NE(shadow.error().message.find("--shadow key:tree: use --caster key:tree="),
              std::string::npos)
        << shadow.error().message;
}

TEST(Rows, ClampGivesBackWhatItRemoved) {
    const LayerStack& stack = made_stack();
    // As the render without clamp would be: each layer with what it lost, in the header's order
    const auto whole = mixed(stack, look_of({{Clamp, "all=1"}}));
    expect_pixels(whole, "R", [](size_t i) {
        const auto v = [i](const char* name) { return made_value(name, i); };
        return fold({v("b0_key.R"), v("b1_key.R"), v("tail_key.R") + v("clamp_tail_key.R"),
                     v("clamp_b0_fill.R"), v("b1_fill.R"),
                     v("tail_fill.R") + v("clamp_tail_fill.R")});
    });
    const auto some = mixed(stack, look_of({{Clamp, "key=0.5"}, {Gain, "tail=2"}}));
    expect_pixels(some, "B", [](size_t i) {
        const auto v = [i](const char* name) { return made_value(name, i); };
        return fold({v("b0_key.B"), v("b1_key.B"),
                     2.0f * (v("tail_key.B") + 0.5f * v("clamp_tail_key.B")), v("b1_fill.B"),
                     2.0f * v("tail_fill.B")});
    });
    EXPECT_TRUE(mix::plan_mix(stack, look_of({{Clamp, "all=0"}}))->notes.empty());
    film::Film film({0, 0, 4, 4}, film::test_layer_set());
    film::render(film, 0, 2);
    EXPECT_EQ(mix::plan_mix(through_file(film), look_of({{Clamp, "all=1"}}))->notes.size(), 1u);
}

/// Black as rendered, and not black when what the clamp took is in it.
TEST(Rows, ALayerThatTheClampTookWholeIsStoredWhenItIsGivenBack) {
    const Look look = look_of({{Clamp, "all=1"}});
    const auto plan = mix::plan_mix(made_stack(), look);
    ASSERT_TRUE(plan.has_value());
    const auto out = LayerStack::from_image(mix::apply_mix(made_stack(), *plan, look, true));
    ASSERT_TRUE(out.has_value());
    const auto check = layers::check_layers(out->image(), out->header());
    EXPECT_TRUE(check.is_good()) << check.problems[0];
}

TEST(Rows, ASetOfRowsHasAMaster) {
    const LayerStack& stack = made_stack();
    Look look = look_of({{Gain, "warm=2"}, {Mute, "warm:b0"}, {Gain, "key=0.5"}});
    ASSERT_TRUE(add_rows(look, "warm=key,fill:tail").has_value());
    const auto plan = mix::plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    std::map<std::string, float> gains;
    for (const mix::MixPlan::Term& t : plan->terms) gains[t.layer] = t.gain[0];
    const std::map<std::string, float> expected = {{"b0_key", 0.0f},
                                                   {"b1_key", 1.0f},
                                                   {"tail_key", 1.0f},
                                                   {"b1_fill", 1.0f},
                                                   {"tail_fill", 2.0f}};
    EXPECT_EQ(gains, expected);
    Look lifted = look_of({{Shadow, "both=1"}});
    ASSERT_TRUE(add_rows(lifted, "both=key,fill").has_value());
    EXPECT_EQ(mix::plan_mix(stack, lifted)->shadow_terms.size(), 2u);
    for (const char* bad : {"all=key", "x", "=key", "a:b=key", "x=", "x=key,,fill"}) {
        Look none;
        EXPECT_EQ(add_rows(none, bad).error().code, "bad-gain") << bad;
    }
}

/// A word that means nothing in a file is no suggestion for itself, and says what is not stored.
TEST(Rows, WordsForBouncesThatAreNotStoredSaySo) {
    const auto stack_of = [](int bounces, bool has_bounces) {
        film::LayerSet set = film::test_layer_set();
        set.last_bounce = bounces;
        set.group_layers = true;
        set.bounce_layers = has_bounces;
        set.matrix_layers = set.shadow_layers = false;
        film::Film film({0, 0, 4, 4}, set);
        film::render(film, 0, 2);
        return through_file(film);
    };
    const auto said = [](const LayerStack& stack, const char* gain) {
        const auto plan = mix::plan_mix(stack, look_of({{Gain, gain}}));
        return plan ? std::string() : plan.error().message;
    };
    const LayerStack without = stack_of(3, false), all_in_tail = stack_of(0, true);
    for (const char* word : {"indirect", "direct", "tail", "b2", "key:indirect"}) {
        const std::string message = said(without, (word + std::string("=2")).c_str());
        EXPECT_NE(message.find("it has no bounce layers; render with --layers bounce or matrix"),
                  std::string::npos)
            << message;
        EXPECT_EQ(message.find("did you mean"), std::string::npos) << message;
    }
    EXPECT_NE(said(all_in_tail, "indirect=2").find("`tail` contains all light after b0"),
              std::string::npos)
        << said(all_in_tail, "indirect=2");
    EXPECT_NE(said(without, "kye=2").find("did you mean 'key'"), std::string::npos);
}

TEST(Rows, UnknownNamesAreToldTogetherWithTheNearest) {
    const Look look =
        look_of({{Gain, "kye=2"}, {Mute, "moon"}, {Gain, "fill:b9=2"}, {Gain, "key=2"}});
    const auto plan = mix::plan_mix(made_stack(), look);
    ASSERT_FALSE(plan.has_value());
    EXPECT_EQ(plan.error().code, "unknown-name");
    for (const char* text : {"no 'kye' in this file (did you mean 'key'?)", "no 'moon'", "no 'b9'",
                             "groups: key fill", "bounces: b0 b1 tail"}) {
        EXPECT_NE(plan.error().message.find(text), std::string::npos) << plan.error().message;
    }
}

TEST(Rows, APresetOfAnotherShotFitsWithoutWhatIsNotHere) {
    film::LayerSet set = film::test_layer_set();
    film::Film film({0, 0, 4, 4}, set);
    film::render(film, 0, 2);
    const LayerStack stack = through_file(film);
    Look look = look_of({{Gain, "kye=2"}, {Shadow, "key=0.5"}, {Gain, "fill=3"}, {Gain, "set=2"}});
    ASSERT_TRUE(add_rows(look, "set=key,moon").has_value());
    const mix::FittedLook fitted = mix::fit_look(stack, look);
    ASSERT_EQ(fitted.omitted.size(), 3u);
    EXPECT_NE(fitted.omitted[0].find("moon of --rows set"), std::string::npos);
    EXPECT_NE(fitted.omitted[1].find("did you mean 'key'"), std::string::npos);
    EXPECT_NE(fitted.omitted[2].find("S_key"), std::string::npos);
    const auto plan = mix::plan_mix(stack, fitted.look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    std::map<std::string, float> gains;
    for (const mix::MixPlan::Term& t : plan->terms) gains[t.layer] = t.gain[0];
    EXPECT_EQ(gains["C_fill"], 3.0f);
    EXPECT_EQ(gains["C_key"], 2.0f);
    EXPECT_EQ(gains["C_sky"], 1.0f);
}

/// Each of two controls alone has a family that can express it, both together have none.
TEST(Rows, AFittedLookIsOneThatCanBeMixed) {
    film::LayerSet set = film::test_layer_set();
    film::Film film({0, 0, 4, 4}, set);
    film::render(film, 0, 2);
    const LayerStack stack = through_file(film);
    const Look both = look_of({{Gain, "key=2"}, {Gain, "b1=3"}, {Tint, "fill=1,0,1"}});
    ASSERT_EQ(mix::plan_mix(stack, both).error().code, "mix-not-stored");
    const mix::FittedLook fitted = mix::fit_look(stack, both);
    ASSERT_EQ(fitted.omitted.size(), 1u);
    EXPECT_NE(fitted.omitted[0].find("--gain b1"), std::string::npos) << fitted.omitted[0];
    EXPECT_TRUE(mix::plan_mix(stack, fitted.look).has_value());
    // Together they can be followed: nothing is left of any row
    const Look silent = look_of({{Gain, "key=2"}, {Gain, "b1=3"}, {Mute, "all"}});
    EXPECT_TRUE(mix::fit_look(stack, silent).omitted.empty());
    // A matte that cannot be had takes its control with it, and only that
    Look matted = look_of({{Gain, "key=2"}, {Gain, "fill=2"}});
    matted.controls[0].matte = "CryptoObject:tree";
    const mix::FittedLook without_matte = mix::fit_look(stack, matted);
    ASSERT_EQ(without_matte.omitted.size(), 1u);
    ASSERT_EQ(without_matte.look.controls.size(), 1u);
    EXPECT_EQ(without_matte.look.controls[0].target, "fill");
}

/// Object /World/Tree over the left columns of the image by half, /World/House elsewhere.
image::Image layers_with_cryptomatte() {
    image::Image image = made_layers();
    const layers::Cryptomatte matte{"CryptoObject",
                                    {{"/World/House", layers::matte_id("/World/House")},
                                     {"/World/Tree", layers::matte_id("/World/Tree")}}};
    layers::describe_cryptomatte(matte, image.attributes);
    image::Part& part = image.parts.emplace_back();
    part.name = "CryptoObject";
    for (const char* c : {"R", "G", "B", "A"}) {
        part.channels.push_back(image::Channel::make(std::string("CryptoObject00.") + c,
                                                     image::ChannelType::Float,
                                                     image.data.pixel_count()));
    }
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const bool has_tree = i % size_t(image.data.width()) < 10;
        const std::array<float, 4> rgba = {
            std::bit_cast<float>(matte.names[0].id), has_tree ? 0.5f : 1.0f,
            std::bit_cast<float>(matte.names[1].id), has_tree ? 0.5f : 0.0f};
        for (size_t c = 0; c < 4; ++c)
            std::get<std::vector<float>>(part.channels[c].data)[i] = rgba[c];
    }
    return image;
}

Look matted(Look look, const std::string& matte) {
    look.controls.back().matte = matte;
    return look;
}

TEST(Mattes, AGainActsWithinACryptomatte) {
    const auto stack = LayerStack::from_image(layers_with_cryptomatte());
    ASSERT_TRUE(stack.has_value());
    const auto width = size_t(stack->image().data.width());
    const Look look = matted(look_of({{Gain, "fill=0.5"}, {Gain, "key=3"}}), "object:/World/Tree");
    const auto image = mixed(*stack, look);
    expect_pixels(image, "R", [&](size_t i) {
        const auto v = [i](const char* name) { return made_value(name, i); };
        const float m = i % width < 10 ? 0.5f : 0.0f, key = 1.0f + m * 2.0f;
        return fold({v("b0_key.R") * key, v("b1_key.R") * key, v("tail_key.R") * key,
                     0.5f * v("b1_fill.R"), 0.5f * v("tail_fill.R")});
    });
    // A solo mutes the others within its matte alone, a lifted shadow is lifted there alone
    const auto solo = mixed(*stack, matted(look_of({{Solo, "key"}}), "!CryptoObject:/World/House"));
    expect_pixels(solo, "R", [&](size_t i) {
        const auto v = [i](const char* name) { return made_value(name, i); };
        const float others = i % width < 10 ? 0.5f : 1.0f;
        return fold({v("b0_key.R"), v("b1_key.R"), v("tail_key.R"), v("b1_fill.R") * others,
                     v("tail_fill.R") * others});
    });
    const auto lifted = mixed(*stack, matted(look_of({{Shadow, "key=1"}}), "object:/World/Tree"));
    expect_pixels(lifted, "G", [&](size_t i) {
        const float m = i % width < 10 ? 0.5f : 0.0f;
        return stack->image().find("G")->value(i) + m * made_value("S_key.G", i);
    });
}

TEST(Mattes, OfAFileAreReadStripByStrip) {
    const std::string path = film::temporary_file("matted.exr");
    ASSERT_TRUE(image::write_exr(path, layers_with_cryptomatte()).has_value());
    const auto file = layers::StripReader::open(path);
    ASSERT_TRUE(file.has_value());
    const auto layout = LayerStack::describe(*file, path), stack = LayerStack::load(path);
    const Look look = matted(look_of({{Gain, "key=3"}}), "CryptoObject:/World/T*");
    const auto plan = mix::plan_mix(*layout, look, &*file);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const auto from_file = mix::mix_file(*file, *layout, *plan, look, false);
    ASSERT_TRUE(from_file.has_value());
    const auto in_memory = mixed(*stack, look);
    EXPECT_EQ(from_file->find("R")->data, in_memory.find("R")->data);
}

TEST(Mattes, MayBeImages) {
    const LayerStack& stack = made_stack();
    image::Image mask = made_foreign({{"", {"mask.M"}}});
    const std::string path = film::temporary_file("mask.exr");
    ASSERT_TRUE(image::write_exr(path, mask).has_value());
    const auto image = mixed(stack, matted(look_of({{Gain, "all=2"}}), path + ":mask.M"));
    expect_pixels(image, "R", [](size_t i) {
        const auto v = [i](const char* name) {
            return made_value(name, i) * (1.0f + made_value("mask.M", i));
        };
        return fold(
            {v("b0_key.R"), v("b1_key.R"), v("tail_key.R"), v("b1_fill.R"), v("tail_fill.R")});
    });
    const auto error_of = [&](const std::string& matte) {
        return mix::plan_mix(stack, matted(look_of({{Gain, "all=2"}}), matte)).error().code;
    };
    EXPECT_EQ(error_of(path + ":mask.N"), "matte-channel");
    EXPECT_EQ(error_of(film::temporary_file("none.exr") + ":R"), "io-open");
    EXPECT_EQ(error_of("CryptoObject:/World/Tree"), "matte-layer");
    EXPECT_EQ(error_of("tree"), "bad-matte");
    mask.data.x1 -= 1;
    mask.parts[0].channels[0] =
        image::Channel::make("mask.M", image::ChannelType::Half, mask.data.pixel_count());
    ASSERT_TRUE(image::write_exr(path, mask).has_value());
    EXPECT_EQ(error_of(path + ":mask.M"), "matte-window");
}

}  // namespace
}  // namespace velatura::compositor
