// SPDX-License-Identifier: Apache-2.0
// Gains by light, lobe and bounce: every cell of the lobe matrix counts the product of all gains
// whose names it fits, decided here by its own labels.
#include "compositor/exports/export.h"
#include "compositor/look/look_rows.h"
#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_plan.h"
#include "compositor/noise/noise.h"
#include "compositor/nuke_reader.h"
#include "compositor/test_stack.h"
#include "film/lobe_layers.h"
#include "layers/layer_check.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;

constexpr image::Window window{0, 0, 20, 17};

LayerStack rendered(bool has_coarser = true, bool has_shadows = true, bool has_halves = false) {
    film::LayerSet set = film::test_layer_set();
    set.path_layers = film::lobes_of_matrix();
    set.matrix_layers = set.bounce_layers = set.group_layers = has_coarser;
    set.shadow_layers = has_shadows;
    set.halves = has_halves;
    film::Film film(window, set);
    film::render(film, 0, 8);
    return through_file(film);
}

/// Whether a word of a name is about the light of a layer.
bool fits(const std::string& word, const accumulate::LayerEntry& e) {
    if (word == "all" || word == e.group || word == e.bounce || word == e.lobe) return true;
    if (word == "direct") return e.bounce == "b1";
    if (word == "indirect") return e.bounce != "b0" && e.bounce != "b1";
    return word == "env" && e.group == "sky";
}

/// A name with a gain for each channel.
struct Asked {
    std::string name;
    std::array<float, 3> gain;
};

float asked_gain(const std::vector<Asked>& asked, const accumulate::LayerEntry& e, size_t c) {
    float gain = 1;
    for (const Asked& a : asked) {
        bool fits_all = true;
        size_t begin = 0;
        while (begin <= a.name.size()) {
            const size_t end = std::min(a.name.find(':', begin), a.name.size());
            fits_all = fits_all && fits(a.name.substr(begin, end - begin), e);
            begin = end + 1;
        }
        if (fits_all) gain *= a.gain[c];
    }
    return gain;
}

Look look_of_gains(const std::vector<Asked>& asked) {
    Look look;
    for (const Asked& a : asked)
        look.controls.push_back(*parse_control(Tint, a.name + "=" + std::to_string(a.gain[0]) +
                                                         "," + std::to_string(a.gain[1]) + "," +
                                                         std::to_string(a.gain[2])));
    return look;
}

const std::vector<std::vector<Asked>>& asked_looks() {
    static const std::vector<std::vector<Asked>> looks = {
        {{"specular", {2, 2, 2}}},
        {{"key:specular", {0.25f, 1, 2}}},
        {{"key:specular:b1", {4, 4, 4}}},
        {{"key:b1:specular", {4, 4, 4}}},
        {{"specular:b2", {0, 0, 0}}, {"all", {0.5f, 0.5f, 0.5f}}},
        {{"diffuse:indirect", {3, 2, 1}}, {"fill", {0, 1, 1}}, {"coat:direct", {8, 8, 8}}},
        {{"env:transmit", {0.5f, 0.25f, 0.125f}}, {"subsurface", {2, 1, 1}}, {"b0", {0, 0, 0}}},
        {{"emission", {3, 3, 3}}, {"volume:tail", {0, 0, 2}}, {"key:b2", {2, 2, 2}}},
    };
    return looks;
}

/// Of the layers as stored, in double.
std::vector<double> expected_mix(const LayerStack& stack,
                                 const std::vector<Asked>& asked,
                                 size_t c,
                                 std::vector<double>& size) {
    std::vector<double> sum(window.pixel_count(), 0.0);
    size.assign(window.pixel_count(), 0.0);
    for (const accumulate::LayerEntry& e : stack.header().layers) {
        if (e.family != "lobe-matrix" || e.is_empty) continue;
        const double gain = double(asked_gain(asked, e, c));
        image::for_each_value(*stack.channel(e.name, c), [&](size_t i, float v) {
            sum[i] += gain * double(v);
            size[i] += std::abs(gain * double(v));
        });
    }
    return sum;
}

TEST(LobeMatrix, EveryCellCountsTheProductOfWhatFitsIt) {
    for (const bool has_coarser : {false, true}) {
        const LayerStack stack = rendered(has_coarser);
        ASSERT_TRUE(stack.has_family("lobe-matrix"));
        for (const std::vector<Asked>& asked : asked_looks()) {
            SCOPED_TRACE(asked[0].name);
            const Look look = look_of_gains(asked);
            const auto plan = plan_mix(stack, look);
            ASSERT_TRUE(plan.has_value()) << plan.error().message;
            EXPECT_EQ(plan->family, "lobe-matrix");
            const image::Image mixed = apply_mix(stack, *plan, look, false);
            const image::Image plain = apply_mix(stack, *plan_mix(stack, {}), {}, false);
            double changed = 0;
            for (size_t c = 0; c < 3; ++c) {
                std::vector<double> size;
                const std::vector<double> expected = expected_mix(stack, asked, c, size);
                const image::Channel *now = mixed.find(std::string(1, "RGB"[c])),
                                     *before = plain.find(std::string(1, "RGB"[c]));
                for (size_t i = 0; i < expected.size(); ++i) {
                    ASSERT_NEAR(double(now->value(i)), expected[i], 1e-5 * size[i] + 1e-12) << i;
                    changed += std::abs(double(now->value(i)) - double(before->value(i)));
                }
            }
            EXPECT_GT(changed, 0.01) << "the gains turn nothing";
        }
    }
}

TEST(LobeMatrix, UnitGainsGiveTheBeautyBitForBit) {
    const LayerStack stack = rendered();
    const image::Image mixed = apply_mix(stack, *plan_mix(stack, {}), {}, false);
    for (const char* name : {"R", "G", "B"}) {
        const image::Channel *a = mixed.find(name), *b = stack.image().find(name);
        for (size_t i = 0; i < a->size(); ++i) ASSERT_EQ(a->value(i), b->value(i)) << name << i;
    }
}

TEST(LobeMatrix, FadersMultiplyToTheGainsOfTheMix) {
    const LayerStack stack = rendered(false);
    for (const std::vector<Asked>& asked : asked_looks()) {
        const auto plan = plan_mix(stack, look_of_gains(asked));
        ASSERT_TRUE(plan.has_value());
        const RowNames names(stack, {});
        for (const accumulate::LayerEntry& e : stack.header().layers) {
            if (e.family != "lobe-matrix") continue;
            const auto factor = plan->faders.factor(names.column_of(e.bounce),
                                                    names.group_of(e.group), names.lobe_of(e.lobe));
            for (size_t c = 0; c < 3; ++c)
                EXPECT_FLOAT_EQ(factor[c], asked_gain(asked, e, c)) << e.name;
        }
    }
    const auto soloed =
        plan_mix(stack, look_of({{Solo, "specular"}, {Solo, "key:diffuse"}, {Mute, "fill:coat"}}));
    ASSERT_TRUE(soloed.has_value());
    const RowNames names(stack, {});
    for (const accumulate::LayerEntry& e : stack.header().layers) {
        if (e.family != "lobe-matrix") continue;
        const bool is_heard = e.lobe == "specular" || (e.lobe == "diffuse" && e.group == "key");
        EXPECT_EQ(soloed->faders.lobes.size(), 7u);
        EXPECT_EQ(soloed->faders.factor(names.column_of(e.bounce), names.group_of(e.group),
                                        names.lobe_of(e.lobe))[0],
                  is_heard ? 1.0f : 0.0f)
            << e.name;
    }
}

TEST(LobeMatrix, NamesThatAreNoLightAreTold) {
    const LayerStack stack = rendered(), matrix = [] {
        film::LayerSet set = film::test_layer_set();
        set.matrix_layers = true;
        film::Film film(window, set);
        film::render(film, 0, 4);
        return through_file(film);
    }();
    const auto message = [](const LayerStack& of, const std::string& name) {
        const auto plan = plan_mix(of, look_of({{Mute, name.c_str()}}));
        EXPECT_FALSE(plan.has_value()) << name;
        return plan ? std::string() : plan.error().code + ": " + plan.error().message;
    };
    EXPECT_NE(message(matrix, "specular").find("render with --layers lobe-matrix"),
              std::string::npos)
        << message(matrix, "specular");
    EXPECT_NE(message(matrix, "key:specular").find("--layers lobe-matrix"), std::string::npos);
    // Emission that is seen directly has scattered by no lobe
    for (const char* none : {"specular:b0", "key:specular:b0", "emission:b1", "key:b1:b2",
                             "key:fill", "specular:diffuse"})
        EXPECT_NE(message(stack, none).find("no light is both"), std::string::npos)
            << message(stack, none);
    EXPECT_NE(message(stack, "key:specullar").find("did you mean 'specular'"), std::string::npos)
        << message(stack, "key:specullar");
    // Several names at once list the lobes
    const auto plan = plan_mix(stack, look_of({{Mute, "kay"}, {Mute, "key:sheen"}}));
    ASSERT_FALSE(plan.has_value());
    EXPECT_NE(plan.error().message.find("lobes: emission diffuse specular coat"), std::string::npos)
        << plan.error().message;
}

/// A light that is called like a lobe is that light; the lobe has its place after a colon.
TEST(LobeMatrix, ALightMayBeCalledLikeALobe) {
    film::LayerSet set = film::test_layer_set();
    set.path_layers = film::lobes_of_matrix();
    set.bounce_layers = set.group_layers = false;
    set.groups[1].name = "specular";
    film::Film film(window, set);
    film::render(film, 0, 4);
    const LayerStack stack = through_file(film);
    const RowNames names(stack, {});
    const auto light = names.select("specular"), lobe = names.select("all:specular"),
               both = names.select("specular:specular");
    ASSERT_TRUE(light && lobe && both);
    for (size_t c = 0; c < names.column_count(); ++c)
        for (size_t g = 0; g < names.group_count(); ++g)
            for (size_t l = 0; l < names.lobe_count(); ++l) {
                const size_t cell = names.cell(c, g, l);
                const bool is_lobe = names.lobe_names()[l] == "specular";
                EXPECT_EQ((*light)[cell], g == 1);
                EXPECT_EQ((*lobe)[cell], is_lobe);
                EXPECT_EQ((*both)[cell], is_lobe && g == 1);
            }
}

TEST(LobeMatrix, SetsOfRowsTakeLobes) {
    const LayerStack stack = rendered();
    Look look = look_of({{Gain, "shiny:b1=2"}});
    ASSERT_TRUE(add_rows(look, "shiny=specular,key:coat").has_value());
    const auto plan = plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    for (const MixPlan::Term& term : plan->terms) {
        const accumulate::LayerEntry& e = *stack.header().find(term.layer);
        const bool is_in =
            e.bounce == "b1" && (e.lobe == "specular" || (e.lobe == "coat" && e.group == "key"));
        EXPECT_EQ(term.gain[0], is_in ? 2.0f : 1.0f) << e.name;
    }
}

/// Shadows are stored by light, not by lobe.
TEST(LobeMatrix, ShadowsNeedOneGainForAllLobesOfTheirLight) {
    const LayerStack stack = rendered();
    const auto refused = plan_mix(stack, look_of({{Gain, "key:specular=2"}, {Shadow, "key=1"}}));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "mix-not-stored");
    EXPECT_NE(refused.error().message.find("key:direct"), std::string::npos);
    // Another light, or a later bounce, is none of its business
    for (const char* gain : {"fill:specular=2", "key:specular:b2=2", "key=2"})
        EXPECT_TRUE(plan_mix(stack, look_of({{Gain, gain}, {Shadow, "key=1"}})).has_value())
            << gain;
}

TEST(LobeMatrix, AMixWithLayersClosesAndDropsWhatHasNoGain) {
    const LayerStack stack = rendered(true, true, true);
    Look look = look_of({{Gain, "key:specular=2"},
                         {Tint, "diffuse=1,.5,.25"},
                         {Gain, "sky=3"},
                         {Shadow, "sky=0.5"}});
    // One gain for all lobes of the sky's direct light
    look.controls.push_back(*parse_control(Tint, "sky:diffuse:direct=1,2,4"));
    const auto plan = plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const auto outcomes = layer_outcomes(stack, *plan, 1);
    EXPECT_EQ(outcomes.at("S_key"), LayerOutcome::NotStored);
    EXPECT_EQ(outcomes.at("U_key"), LayerOutcome::NotStored);
    EXPECT_EQ(outcomes.at("S_sky"), LayerOutcome::Shadow);
    EXPECT_EQ(outcomes.at("b1_key"), LayerOutcome::Sum);
    EXPECT_EQ(outcomes.at("C_key"), LayerOutcome::Sum);
    const std::string path = film::temporary_file("lobes_mixed.exr");
    ASSERT_TRUE(layers::write_image_file(path, apply_mix(stack, *plan, look, true)).has_value());
    const auto mixed = LayerStack::load(path);
    ASSERT_TRUE(mixed.has_value()) << mixed.error().message;
    const auto check = layers::check_layers(mixed->image(), mixed->header());
    EXPECT_TRUE(check.is_good()) << check.problems[0];
    // Its coarser layers are the sums of graded cells
    for (size_t c = 0; c < 3; ++c) {
        std::vector<double> sum(window.pixel_count(), 0.0);
        for (const accumulate::LayerEntry& e : mixed->header().layers)
            if (e.family == "lobe-matrix" && e.group == "key" && !e.is_empty)
                image::for_each_value(*mixed->channel(e.name, c),
                                      [&](size_t i, float v) { sum[i] += double(v); });
        image::for_each_value(*mixed->channel("C_key", c), [&](size_t i, float v) {
            EXPECT_NEAR(double(v), sum[i], 2e-3 * std::abs(sum[i]) + 1e-6);
        });
    }
}

TEST(LobeMatrix, NoiseIsToldByLobe) {
    const LayerStack stack = rendered(false, false, true);
    const auto forecast = noise::forecast_noise(stack, look_of({{Gain, "key:specular=8"}}), {});
    ASSERT_TRUE(forecast.has_value()) << forecast.error().message;
    double sum = 0;
    for (const noise::RowNoise& row : forecast->lobes) sum += row.share;
    EXPECT_NEAR(sum, 1.0, 1e-6);
    ASSERT_EQ(forecast->lobes.size(), 7u);
    const auto muted = noise::forecast_noise(stack, look_of({{Solo, "coat"}}), {});
    ASSERT_TRUE(muted.has_value());
    EXPECT_EQ(muted->lobes[0].name, "coat");
    EXPECT_NEAR(muted->lobes[0].share, 1.0, 1e-9);
}

TEST(LobeMatrix, TheNukeGroupHasFadersOfLobesAndIsTheMix) {
    const LayerStack stack = rendered(false);
    for (const std::vector<Asked>& asked : asked_looks()) {
        SCOPED_TRACE(asked[0].name);
        const Look look = look_of_gains(asked);
        const auto plan = plan_mix(stack, look);
        ASSERT_TRUE(plan.has_value());
        const auto script = exports::nuke_script(stack, *plan, look, "x.exr");
        ASSERT_TRUE(script.has_value()) << script.error().message;
        const NukeReader nuke(*script, stack.image());
        for (const char* lobe : {"diffuse", "specular", "coat", "transmit", "subsurface", "volume"})
            EXPECT_TRUE(nuke.knobs.contains(std::string("gain_") + lobe)) << lobe;
        const image::Image mixed = apply_mix(stack, *plan, look, false);
        for (size_t c = 0; c < 3; ++c) {
            const image::Channel* channel = mixed.find(std::string(1, "RGB"[c]));
            double scale = 0;
            image::for_each_value(
                *channel, [&](size_t, float v) { scale = std::max(scale, std::abs(double(v))); });
            for (size_t i = 0; i < channel->size(); ++i)
                ASSERT_NEAR(nuke.result()[c][i], channel->value(i), 2e-6 * scale + 1e-12) << i;
        }
    }
}

TEST(LobeMatrix, RowsHaveTheirPlaces) {
    const MixerRows rows = mixer_rows(rendered());
    EXPECT_EQ(rows.lobes, (std::vector<std::string>{"emission", "diffuse", "specular", "coat",
                                                    "transmit", "subsurface", "volume"}));
    for (const char* target :
         {"specular", "key:specular", "specular:b1", "key:specular:b1", "key:b1", "all"})
        EXPECT_TRUE(rows.has_place(Gain, target)) << target;
    for (const char* target : {"key:b1:specular", "b1:specular", "key:fill", "sheen"})
        EXPECT_FALSE(rows.has_place(Gain, target)) << target;
}

}  // namespace
}  // namespace velatura::compositor::mix
