// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/levels.h"

#include "compositor/made_layers.h"
#include "compositor/window/tile_mix.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::compositor::window {
namespace {

float stored(const LayerStack& stack, const image::Channel& channel, int x, int y) {
    const image::Image& image = stack.image();
    return image.data.contains(x, y) ? channel.value(image.data.index(x, y)) : 0.0f;
}

TEST(HalfSize, IsTheMeanOfFourPixels) {
    // Data and display windows at odd places, and a display window that does not begin at 0
    const auto stack = LayerStack::load(window_file("odd.exr", {3, 2, 22, 17}, {-1, 1, 20, 18}));
    ASSERT_TRUE(stack.has_value());
    const image::Image half = half_size(*stack);
    EXPECT_EQ(half.display, (image::Window{0, 0, 11, 9}));
    const image::Channel* beauty = stack->channel("b1_key", 1);
    const image::Channel* small = half.find("b1_key.G");
    ASSERT_TRUE(beauty && small);
    EXPECT_EQ(small->type(), beauty->type());
    for (int y = half.data.y0; y < half.data.y1; ++y) {
        for (int x = half.data.x0; x < half.data.x1; ++x) {
            float sum = 0;
            int count = 0;
            for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
                const int fx = 2 * x + dx, fy = 2 * y + dy;
                if (fx >= 21 || fy >= 17) continue;
                sum += stored(*stack, *beauty, fx - 1, fy + 1);
                ++count;
            }
            const float mean = sum / float(count);
            EXPECT_NEAR(small->value(half.data.index(x, y)), mean, 1e-3f * std::abs(mean) + 1e-6f);
        }
    }
}

TEST(HalfSize, KeepsWhatIsShown) {
    const image::Image half = half_size(small_levels()->stack(0));
    EXPECT_NE(half.find("R"), nullptr);
    EXPECT_NE(half.find("b2_fill.B"), nullptr);
    EXPECT_NE(half.find("S_key.R"), nullptr);
    // No rows, but layers that can be looked at by themselves
    EXPECT_NE(half.find("b2_fill_hA.B"), nullptr);
    EXPECT_NE(half.find("N.X"), nullptr);
}

TEST(Levels, OfAForeignFileHoldItsRows) {
    image::Image image;
    image.data = image.display = {0, 0, 200, 110};
    image.parts.emplace_back();
    for (const auto& [name, value] : {std::pair{"R", 4.0f},
                                      {"G", 3.0f},
                                      {"B", 2.0f},
                                      {"lamp.R", 1.0f},
                                      {"lamp.G", 1.0f},
                                      {"lamp.B", 1.0f}}) {
        image::Channel channel;
        channel.name = name;
        channel.data = std::vector<float>(image.data.pixel_count(), value);
        image.parts[0].channels.push_back(std::move(channel));
    }
    auto stack = LayerStack::from_image(std::move(image), ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    ASSERT_TRUE(levels.has_value());
    ASSERT_EQ(levels->count(), 2u);
    const LayerStack& small = levels->stack(1);
    EXPECT_TRUE(small.is_plain());
    EXPECT_EQ(small.group_names(), levels->stack(0).group_names());
    Look look;
    look.controls = {*parse_control(Control::Kind::Mute, "lamp")};
    const auto plan = mix::plan_mix(levels->stack(0), look);
    ASSERT_TRUE(plan.has_value());
    for (const size_t level : {0u, 1u})
        EXPECT_EQ(mix_tile(levels->stack(level), *plan, 0, {0, 0, 1, 1}),
                  (std::vector<float>{3, 2, 1}));
}

TEST(Levels, HaveAPixelForEachOfTheScreen) {
    const auto levels = levels_of(plain_file("large.exr", {0, 0, 601, 403}));
    ASSERT_EQ(levels->count(), 3u);
    EXPECT_EQ(levels->frame(1), (image::Window{0, 0, 301, 202}));
    EXPECT_EQ(levels->level_for(4), 0u);
    EXPECT_EQ(levels->level_for(1), 0u);
    EXPECT_EQ(levels->level_for(0.51), 0u);
    EXPECT_EQ(levels->level_for(0.5), 1u);
    EXPECT_EQ(levels->level_for(0.2), 2u);
    EXPECT_EQ(levels->level_for(0.001), 2u);
    EXPECT_EQ(levels->quick_level(), 1u);
}

TEST(Levels, AnImageThatNoWindowCanShowIsRefused) {
    // Few pixels are stored, but each tile of the image would have a place in memory
    image::Image image = made_layers();
    image.display = {0, 0, 2'000'000'000, 2'000'000'000};
    auto stack = LayerStack::from_image(std::move(image));
    ASSERT_TRUE(stack.has_value());
    const auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    ASSERT_FALSE(levels.has_value());
    EXPECT_EQ(levels.error().code, "too-large");
}

}  // namespace
}  // namespace velatura::compositor::window
