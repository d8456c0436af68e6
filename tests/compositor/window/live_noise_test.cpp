// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/live_noise.h"

#include "window_stack.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::compositor::window {
namespace {

double share_of(const std::vector<noise::RowNoise>& rows, const std::string& name) {
    const auto at = std::find_if(rows.begin(), rows.end(),
                                 [&](const noise::RowNoise& r) { return r.name == name; });
    return at == rows.end() ? -1 : at->share;
}

TEST(LiveNoise, AllItsPartsAreTheForecastOfTheFile) {
    const auto stack = LayerStack::load(window_file("noise.exr", {0, 0, 150, 120}, {}, 4));
    ASSERT_TRUE(stack.has_value());
    Look look;
    look.controls = {*parse_control(Control::Kind::Gain, "indirect=+2st"),
                     *parse_control(Control::Kind::Mute, "sky")};
    const auto plan = mix::plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    LiveNoise noise(*stack);
    ASSERT_GE(noise.part_count(), 2u);
    noise.begin();
    double first = 0;
    for (size_t i = 0; i < noise.part_count(); ++i) {
        EXPECT_FALSE(noise.is_done());
        noise.advance(*stack, *plan, look);
        if (i == 0) first = noise.mix();
    }
    EXPECT_TRUE(noise.is_done());
    EXPECT_EQ(noise.share(), 1);
    const auto forecast = noise::forecast_noise(*stack, look, 1e30);
    ASSERT_TRUE(forecast.has_value());
    EXPECT_NEAR(noise.mix(), forecast->mix.value, 1e-9 * forecast->mix.value);
    EXPECT_NEAR(noise.rendered(), forecast->rendered.value, 1e-9 * forecast->rendered.value);
    for (const noise::RowNoise& row : forecast->groups)
        EXPECT_NEAR(share_of(noise.groups(), row.name), row.share, 1e-9);
    for (const noise::RowNoise& row : forecast->bounces)
        EXPECT_NEAR(share_of(noise.bounces(), row.name), row.share, 1e-9);
    // A part of the rows tells about the whole
    EXPECT_NEAR(first, noise.mix(), 0.5 * noise.mix());
    noise.begin();
    EXPECT_EQ(noise.share(), 0);
    EXPECT_EQ(noise.mix(), 0);
}

TEST(LiveNoise, KnowsAMatteFromAnotherFile) {
    const auto stack = LayerStack::load(window_file("noise_matte.exr", {0, 0, 150, 120}, {}, 4));
    ASSERT_TRUE(stack.has_value());
    const std::string path = film::temporary_file("noise_matte_m.exr");
    ASSERT_TRUE(write_matte(path, *stack).has_value());
    Look look;
    look.controls = {*parse_control(Control::Kind::Gain, "indirect=+3st")};
    look.controls[0].matte = path + ":M";
    const auto plan = mix::plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value());
    LiveNoise noise(*stack);
    ASSERT_GE(noise.part_count(), 2u);
    while (!noise.is_done()) noise.advance(*stack, *plan, look);
    EXPECT_EQ(noise.error(), "");
    const auto forecast = noise::forecast_noise(*stack, look, 1e30);
    ASSERT_TRUE(forecast.has_value());
    EXPECT_NEAR(noise.mix(), forecast->mix.value, 1e-9 * forecast->mix.value);
    EXPECT_GT(noise.mix(), 1.01 * noise.rendered());
}

TEST(LiveNoise, SaysWhatIsMissing) {
    film::Film film({0, 0, 20, 17}, film::test_layer_set());
    film::render(film, 0, 2);
    const std::string path = film::temporary_file("no_halves.exr");
    ASSERT_TRUE(film.write(path, {}).has_value());
    const auto stack = LayerStack::load(path);
    ASSERT_TRUE(stack.has_value());
    LiveNoise noise(*stack);
    noise.advance(*stack, *mix::plan_mix(*stack, {}), {});
    EXPECT_TRUE(noise.is_done());
    EXPECT_NE(noise.error().find("--halves"), std::string::npos);
}

}  // namespace
}  // namespace velatura::compositor::window
