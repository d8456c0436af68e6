// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/mix.h"

#include "compositor/test_stack.h"
#include "layers/layer_check.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace velatura::compositor::mix {
namespace {

const image::Window window{0, 0, 20, 17};

enum Families { Bounces = 1, Groups = 2, Matrix = 4, Shadows = 8 };

LayerStack stack_of(int families) {
    film::LayerSet set = film::test_layer_set();
    set.bounce_layers = families & Bounces;
    set.group_layers = families & Groups;
    set.matrix_layers = families & Matrix;
    set.shadow_layers = families & Shadows;
    film::Film film(window, set);
    film::render(film, 0, 5);
    return through_file(film);
}

using enum Control::Kind;

image::Image mixed(const LayerStack& stack, const Look& look) {
    const auto plan = plan_mix(stack, look);
    EXPECT_TRUE(plan.has_value()) << plan.error().message;
    return apply_mix(stack, *plan, look, false);
}

bool is_same(const image::Image& a, const image::Image& b, float scale = 1.0f) {
    for (const char* name : {"R", "G", "B"}) {
        for (size_t i = 0; i < window.pixel_count(); ++i) {
            const float x = scale * a.find(name)->value(i), y = b.find(name)->value(i);
            if (std::memcmp(&x, &y, sizeof x) != 0) return false;
        }
    }
    return true;
}

TEST(Mix, UnitGainsGiveTheBeautyBitForBit) {
    for (const int families :
         {0, int(Bounces), int(Groups), Bounces | Groups, Matrix | Bounces | Groups | Shadows}) {
        const LayerStack stack = stack_of(families);
        EXPECT_TRUE(is_same(stack.image(), mixed(stack, {}))) << families;
        const Look unit = look_of({{Gain, "all=1"}, {Tint, "key=1,1,1"}, {Gain, "env=0st"}});
        EXPECT_TRUE(is_same(stack.image(), mixed(stack, unit))) << families;
    }
}

TEST(Mix, OneStopOnIndirectDoublesExactlyTheSumOfB2ToTail) {
    for (const int families : {int(Bounces), Matrix | Bounces | Groups}) {
        const LayerStack stack = stack_of(families);
        const auto solo = mixed(stack, look_of({{Solo, "indirect"}}));
        const auto doubled = mixed(stack, look_of({{Gain, "indirect=+1st"}, {Solo, "indirect"}}));
        EXPECT_TRUE(is_same(solo, doubled, 2.0f));
        EXPECT_FALSE(is_same(solo, stack.image()));
        // By hand, from the stored layers: b0 + b1 + 2·(b2 + tail) in the order of the file
        const auto gained = mixed(stack, look_of({{Gain, "indirect=+1st"}}));
        const auto& order = stack.header().closure[0].order;
        for (size_t i = 0; i < window.pixel_count(); ++i) {
            float fold = 0.0f;
            for (const std::string& layer : order) {
                const std::string bounce = stack.header().find(layer)->bounce;
                const bool is_indirect = bounce == "b2" || bounce == "tail";
                fold += (is_indirect ? 2.0f : 1.0f) * stack.channel(layer, 1)->value(i);
            }
            ASSERT_EQ(gained.find("G")->value(i), fold);
        }
    }
}

TEST(Mix, MuteAndSoloAreComplements) {
    const LayerStack stack = stack_of(Groups);
    const auto without_key = mixed(stack, look_of({{Mute, "key"}}));
    const auto others =
        mixed(stack, look_of({{Solo, "fill"}, {Solo, "env"}, {Solo, "emissive"}, {Solo, "off"}}));
    EXPECT_TRUE(is_same(without_key, others));
    const auto env = mixed(stack, look_of({{Solo, "env"}})),
               sky = mixed(stack, look_of({{Solo, "sky"}}));
    EXPECT_TRUE(is_same(env, sky));
    const auto nothing = mixed(stack, look_of({{Solo, "key"}, {Mute, "key"}}));
    for (size_t i = 0; i < window.pixel_count(); ++i) ASSERT_EQ(nothing.find("R")->value(i), 0.0f);
}

TEST(Mix, CellsNeedTheMatrix) {
    const Look look = look_of({{Gain, "key:b2=4"}});
    const LayerStack matrix = stack_of(Matrix);
    const auto gained = mixed(matrix, look);
    bool differs = false;
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        const double expected = double(matrix.image().find("R")->value(i)) +
                                3.0 * double(matrix.channel("b2_key", 0)->value(i));
        ASSERT_NEAR(gained.find("R")->value(i), expected, 4e-6 * (std::abs(expected) + 100.0));
        differs = differs || gained.find("R")->value(i) != matrix.image().find("R")->value(i);
    }
    EXPECT_TRUE(differs);
    const auto refused = plan_mix(stack_of(Bounces | Groups), look);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "mix-not-stored");
    EXPECT_NE(refused.error().message.find("--layers matrix"), std::string::npos);
}

TEST(Mix, UsesTheFinestFamilyThatCanExpressIt) {
    const LayerStack both = stack_of(Bounces | Groups);
    EXPECT_EQ(plan_mix(both, look_of({{Gain, "b1=2"}}))->family, "bounces");
    EXPECT_EQ(plan_mix(both, look_of({{Gain, "key=2"}}))->family, "groups");
    EXPECT_EQ(plan_mix(both, look_of({{Gain, "all=2"}}))->family, "bounces");
    EXPECT_EQ(plan_mix(stack_of(Matrix), look_of({{Gain, "key=2"}}))->family, "matrix");
    EXPECT_EQ(plan_mix(stack_of(0), look_of({{Gain, "all=2"}}))->family, "beauty");
    EXPECT_NE(plan_mix(stack_of(Bounces), look_of({{Gain, "key=2"}}))
                  .error()
                  .message.find("--layers light"),
              std::string::npos);
    EXPECT_EQ(plan_mix(both, look_of({{Gain, "moon=2"}})).error().code, "unknown-name");
    EXPECT_EQ(plan_mix(both, look_of({{Gain, "b7=2"}})).error().code, "unknown-name");
    EXPECT_EQ(plan_mix(stack_of(Groups), look_of({{Gain, "indirect=2"}})).error().code,
              "unknown-name");
}

TEST(Mix, ShadowLiftAddsTheShadowLayer) {
    const LayerStack stack = stack_of(Matrix | Shadows);
    const auto lifted = mixed(stack, look_of({{Shadow, "key=0.5"}}));
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        const float expected =
            stack.image().find("B")->value(i) + 0.5f * stack.channel("S_key", 2)->value(i);
        ASSERT_EQ(lifted.find("B")->value(i), expected);
    }
    const auto none = mixed(stack, look_of({{Gain, "shadow=0"}})),
               all = mixed(stack, look_of({{Shadow, "all=1"}}));
    EXPECT_TRUE(is_same(none, all));
    EXPECT_EQ(plan_mix(stack_of(Matrix), look_of({{Shadow, "key=0.5"}})).error().code,
              "mix-not-stored");
}

/// With K = 0, direct light is in the tail, beside all that comes after it.
TEST(Mix, WithoutBouncesALiftedShadowTakesTheGainOfTheTail) {
    film::LayerSet set = film::test_layer_set();
    set.last_bounce = 0;
    set.matrix_layers = set.shadow_layers = true;
    film::Film film(window, set);
    film::render(film, 0, 5);
    const LayerStack stack = through_file(film);
    const auto plan =
        plan_mix(stack, look_of({{Gain, "b0=8"}, {Gain, "tail=3"}, {Shadow, "key=1"}}));
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    ASSERT_EQ(plan->shadow_terms.size(), 1u);
    EXPECT_EQ(plan->shadow_terms[0].gain[0], 3.0f);
}

TEST(Mix, ExposureAndTintScaleChannels) {
    const LayerStack stack = stack_of(Groups);
    Look look;
    look.exposure_stops = 1.0f;
    EXPECT_TRUE(is_same(stack.image(), mixed(stack, look), 2.0f));
    const auto red = mixed(stack, look_of({{Tint, "all=1,0,0"}}));
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        ASSERT_EQ(red.find("R")->value(i), stack.image().find("R")->value(i));
        ASSERT_EQ(red.find("G")->value(i), 0.0f);
        ASSERT_EQ(red.find("A")->value(i), stack.image().find("A")->value(i));
    }
}

/// Gains that are good one by one may not be together.
TEST(Mix, GainsMultiplyToSixtyFourStopsAtMost) {
    const LayerStack stack = stack_of(Matrix | Shadows);
    Look look = look_of({{Gain, "key=+40st"}, {Gain, "b1=+20st"}});
    EXPECT_TRUE(plan_mix(stack, look).has_value());
    look.exposure_stops = 5;
    const auto too_bright = plan_mix(stack, look);
    ASSERT_FALSE(too_bright.has_value());
    EXPECT_EQ(too_bright.error().code, "bad-gain");
    EXPECT_NE(too_bright.error().message.find("b1_key"), std::string::npos);
    EXPECT_NE(too_bright.error().message.find("+65"), std::string::npos)
        << too_bright.error().message;
    EXPECT_EQ(plan_mix(stack, look_of({{Gain, "all=+64st"}, {Gain, "all=+64st"}})).error().code,
              "bad-gain");
    const auto muted = plan_mix(stack, look_of({{Tint, "all=1e19,1,1"},
                                                {Tint, "all=1e19,1,1"},
                                                {Tint, "all=1e19,1,1"},
                                                {Mute, "all"}}));
    EXPECT_EQ(muted.error().code, "bad-gain");
    // As dark as one likes
    EXPECT_TRUE(plan_mix(stack, look_of({{Gain, "all=-64st"}, {Gain, "all=-64st"}})).has_value());
    Look matted = look_of({{Gain, "key=+40st"}, {Gain, "key=+40st"}});
    const std::string image = film::temporary_file("stack.exr");
    for (Control& control : matted.controls) control.matte = image + ":A";
    EXPECT_EQ(plan_mix(stack, matted).error().code, "bad-gain");
}

TEST(Mix, ResultIsAFileOfLayersItself) {
    const LayerStack stack = stack_of(Matrix | Shadows);
    const Look look =
        look_of({{Gain, "indirect=+1.3st"}, {Shadow, "fill=0.3"}, {Tint, "key=1,.9,.8"}});
    for (const bool with_layers : {false, true}) {
        const auto out =
            LayerStack::from_image(apply_mix(stack, *plan_mix(stack, look), look, with_layers));
        ASSERT_TRUE(out.has_value()) << out.error().message;
        const auto check = layers::check_layers(out->image(), out->header());
        EXPECT_TRUE(check.is_good()) << check.problems[0];
        EXPECT_EQ(out->header().closure.size(), with_layers ? 1u : 0u);
        if (with_layers) {
            EXPECT_TRUE(is_same(out->image(), mixed(*out, {})));
        }
    }
}

}  // namespace
}  // namespace velatura::compositor::mix
