// SPDX-License-Identifier: Apache-2.0
#include "accumulate/pixel_means.h"
#include "base/hash.h"
#include "film/film_scene.h"
#include "hard_case.h"
#include "layers/layer_file.h"
#include "layers/resolve.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <utility>
#include <vector>

namespace velatura::film {
namespace {

const Window window{0, 0, 20, 18};

TEST(H51Closure, BeautyIsTheFoldOfTheStoredLayersBitForBit) {
    size_t different = 0;
    double worst = 0;
    for (const int variant : {0, 1, 2, 3}) {
        LayerSet set = test_layer_set();
        set.matrix_layers = variant == 1 || variant == 3;
        set.bounce_layers = variant != 2;
        set.float_layers = variant == 3;
        Film film(window, set);
        render(film, 0, 7);
        const auto layers = layers::resolve_layers(film.sums());
        ASSERT_EQ(layers.first_failure, "");
        ASSERT_FALSE(layers.closure.empty());
        EXPECT_EQ(layers.closure[0].family, variant == 2        ? "groups"
                                            : set.matrix_layers ? "matrix"
                                                                : "bounces");
        for (const char* c : {"R", "G", "B"}) {
            for (size_t i = 0; i < window.pixel_count(); ++i) {
                float fold = 0.0f;
                for (const std::string& layer : layers.closure[0].order) {
                    fold += layers.image.find(layer + "." + c)->value(i);
                }
                different += std::bit_cast<uint32_t>(fold) !=
                             std::bit_cast<uint32_t>(layers.image.find(c)->value(i));
            }
        }
        for (const auto& family : layers.closure) {
            EXPECT_GT(family.measured, 0.0) << family.family;
            EXPECT_LE(family.measured, 1.0) << family.family;
            worst = hardcase::larger(worst, family.measured);
        }
    }
    hardcase::expect_within({"pixels whose layers do not add up to the beauty, bit for bit",
                             double(different), 0, 0, "the sum of the stored layers"});
    hardcase::expect_within(
        {"a beauty summed apart from all layers, over the bound that the file states", worst, 1, 0,
         "second sum"});
}

TEST(Closure, MatrixMarginsAreTheBouncesAndGroups) {
    LayerSet with = test_layer_set(), without = test_layer_set();
    with.matrix_layers = true;
    with.float_layers = without.float_layers = true;
    with.shadow_layers = without.shadow_layers = true;
    Film a(window, with), b(window, without);
    render(a, 0, 8);
    render(b, 0, 8);
    const auto matrix = layers::resolve_layers(a.sums()), direct = layers::resolve_layers(b.sums());
    for (const auto& entry : direct.layers) {
        if (entry.is_empty || entry.family == "beauty" || entry.family == "data") continue;
        for (const char* c : {".R", ".G", ".B"}) {
            const image::Channel* x = matrix.image.find(entry.name + c);
            const image::Channel* y = direct.image.find(entry.name + c);
            ASSERT_TRUE(x && y) << entry.name;
            for (size_t i = 0; i < x->size(); ++i) {
                // Two orders of the same double sum, then one rounding to float
                ASSERT_NEAR(x->value(i), y->value(i), 4e-7f * (std::abs(y->value(i)) + 10.0f))
                    << entry.name;
            }
        }
    }
}

TEST(Closure, ShadowIsUnoccludedMinusDirect) {
    LayerSet set = test_layer_set();
    set.matrix_layers = set.shadow_layers = set.float_layers = true;
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    for (int i = 0; i < 4; ++i) {
        s.clear();
        s.add_unoccluded(0, Rgb(8.0f, 4.0f, 2.0f));
        if (i == 0) s.add(1, 0, Rgb(8.0f, 4.0f, 2.0f));
        acc.add(s);
    }
    film.end_pixel(acc);
    const auto layers = layers::resolve_layers(film.sums());
    EXPECT_EQ(layers.image.find("U_key.R")->value(0), 8.0f);
    EXPECT_EQ(layers.image.find("b1_key.R")->value(0), 2.0f);
    EXPECT_EQ(layers.image.find("S_key.R")->value(0), 6.0f);
    EXPECT_EQ(layers.image.find("S_key.B")->value(0), 1.5f);
    // The light that never shines takes no channel, but a line in the list
    EXPECT_EQ(layers.image.find("U_off.R"), nullptr);
}

TEST(H40Clamps, ScaleContributionsToTheirLimitAndKeepTheRest) {
    LayerSet set = test_layer_set();
    set.matrix_layers = set.float_layers = true;
    set.clamp_direct = 2.0f;
    set.clamp_indirect = 0.5f;
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    s.add(1, 0, Rgb(8.0f, 4.0f, 2.0f));
    s.add(1, 1, Rgb(1.5f));
    s.add(2, 1, Rgb(1.5f, 1.0f, 0.25f));
    acc.add(s);
    film.end_pixel(acc);
    const auto layers = layers::resolve_layers(film.sums());
    ASSERT_EQ(layers.first_failure, "");
    const auto value = [&](const char* channel) { return layers.image.find(channel)->value(0); };
    EXPECT_EQ(value("b1_key.R"), 2.0f);
    EXPECT_EQ(value("b1_key.G"), 1.0f);
    EXPECT_EQ(value("clamp_b1_key.B"), 1.5f);
    EXPECT_EQ(value("b1_fill.R"), 1.5f);
    EXPECT_EQ(layers.image.find("clamp_b1_fill.R"), nullptr);
    EXPECT_EQ(value("b2_fill.R"), 0.5f);
    EXPECT_EQ(value("b2_fill.R") + value("clamp_b2_fill.R"), 1.5f);
    EXPECT_EQ(value("R"), 4.0f);
    EXPECT_NEAR(accumulate::clamped_share(film.sums()), 12.33 / 21.25, 0.01);
}

// A path that divides into n brings n contributions, each as strong as the n-th part: the clamp
// takes the same of them
TEST(Clamps, TakeTheSameOfAPathThatDivides) {
    LayerSet set = test_layer_set();
    set.matrix_layers = set.float_layers = true;
    set.clamp_indirect = 0.5f;
    const auto taken = [&set](int branches) {
        Film film({0, 0, 1, 1}, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        film.begin_pixel(acc, 0, 0, 0);
        const float share = 1.0f / float(branches);
        for (int i = 0; i < branches; ++i) s.add(2, 0, share * Rgb(4.0f, 2.0f, 1.0f), share);
        acc.add(s);
        film.end_pixel(acc);
        return layers::resolve_layers(film.sums()).image.find("clamp_b2_key.R")->value(0);
    };
    EXPECT_EQ(taken(1), 3.5f);
    EXPECT_EQ(taken(4), 3.5f);
}

// Whatever a clamp left, exactly what it took comes back
TEST(H40Clamps, GiveBackEveryBit) {
    uint64_t key = 1;
    const auto random = [&key] {
        key = mix64(key);
        return key;
    };
    const uint64_t count = hardcase::sized(2000000, 200000000, 2000000000);
    uint64_t lost = 0;
    for (uint64_t i = 0; i < count; ++i) {
        // Any exponent of a half, and more bits than it has for every second one
        float whole = std::ldexp(1.0f + float(random() >> 40) * 0x1p-24f, int(random() % 39) - 24);
        float cut = whole * (float(random() >> 40) * 0x1p-24f);
        if (i % 3 == 0) cut = whole * (1.0f - float(random() >> 52) * 0x1p-23f);
        if (i % 2 == 0) whole = Imath::half(whole), cut = Imath::half(cut);
        if (i % 4 == 1) cut = Imath::half(cut);
        if (!(cut <= whole)) std::swap(cut, whole);
        const layers::ClampedValue value = layers::undoable_cut(whole, cut);
        lost += std::bit_cast<uint32_t>(value.cut + value.taken) != std::bit_cast<uint32_t>(whole);
        ASSERT_LE(std::abs(value.cut - cut), 0x1p-24f * whole) << cut << " of " << whole;
        ASSERT_GE(value.cut, 0.0f);
        ASSERT_TRUE(i % 2 != 0 || value.cut == cut) << "both are halves";
    }
    hardcase::expect_within(
        {fmt::format(
             "values of {} that the clamped and the removed part do not give back bit for bit",
             count),
         double(lost), 0, 0, "what was clamped"});
    EXPECT_EQ(layers::undoable_cut(1.0f, 1.0f).taken, 0.0f);
}

TEST(H50HalfOverflow, LayersThatOverflowHalfAreStoredFloat) {
    for (const float size : {65504.0f, 65505.0f, 3e30f}) {
        LayerSet set = test_layer_set();
        Film film({0, 0, 1, 1}, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        film.begin_pixel(acc, 0, 0, 0);
        s.add(1, 0, Rgb(size, 1.0f, 1.0f));
        s.add(2, 1, Rgb(1.0f));
        acc.add(s);
        film.end_pixel(acc);
        const auto layers = layers::resolve_layers(film.sums());
        const bool overflows = size > 65504.0f;
        EXPECT_EQ(layers.image.find("b1.R")->type() == image::ChannelType::Float, overflows);
        hardcase::expect_within(
            {fmt::format("a stored layer of {}, error", size),
             std::abs(double(layers.image.find("b1.R")->value(0)) - double(size)), 0, 0,
             "the value"});
        EXPECT_EQ(layers.image.find("b2.R")->type(), image::ChannelType::Half);
        EXPECT_EQ(layers.overflowed.size(), overflows ? 2u : 0u);  // b1 and C_key
        EXPECT_EQ(layers.first_failure, "");
    }
}

/// No film lets such sums in; a damaged checkpoint might have them.
TEST(Closure, ValuesThatAreNotFiniteFail) {
    accumulate::SampleSums sums({0, 0, 1, 1}, test_layer_set());
    const auto sum_of = [](uint32_t accumulator, const accumulate::Triple& value) {
        return accumulate::NodeSums{accumulator, {value}};
    };
    const accumulate::Triple beyond{6e38, 6e38, 6e38};
    const std::vector<accumulate::NodeSums> added = {
        sum_of(accumulate::AccumulatorTable::beauty, beyond),
        sum_of(sums.table().bounce(1), beyond), sum_of(sums.table().group(0), beyond),
        sum_of(accumulate::AccumulatorTable::coverage, accumulate::Triple{1, 1, 1})};
    sums.append(0, 0, {.first = 0, .end = 1}, added);
    EXPECT_NE(layers::resolve_layers(sums).first_failure, "");
    const auto written = layers::write_layer_file(temporary_file("infinite.exr"), sums, {});
    ASSERT_FALSE(written.has_value());
    EXPECT_EQ(written.error().code, "closure-failed");
}

}  // namespace
}  // namespace velatura::film
