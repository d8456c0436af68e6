// SPDX-License-Identifier: Apache-2.0
// Single layers and channels, and pixels that are not shown as they are.
#include "compositor/window/view_mode.h"

#include "image/formats.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>

namespace velatura::compositor::window {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinite = std::numeric_limits<float>::infinity();

using Values = std::function<float(size_t pixel)>;

/// 4 × 2 pixels of another program.
std::shared_ptr<const Levels> levels_of(
    const std::vector<std::pair<std::string, Values>>& channels) {
    image::Image image;
    image.data = image.display = {0, 0, 4, 2};
    image::Part& part = image.parts.emplace_back();
    for (const auto& [name, value] : channels) {
        std::vector<float> values(image.data.pixel_count());
        for (size_t i = 0; i < values.size(); ++i) values[i] = value(i);
        image::Channel channel;
        channel.name = name;
        channel.data = std::move(values);
        part.channels.push_back(std::move(channel));
    }
    auto stack = LayerStack::from_image(std::move(image), ForeignFiles::Plain);
    EXPECT_TRUE(stack.has_value()) << stack.error().message;
    auto levels = Levels::make(std::make_shared<const LayerStack>(std::move(*stack)));
    return std::make_shared<const Levels>(std::move(*levels));
}

Values constant(float v) {
    return [v](size_t) { return v; };
}

/// A file whose beauty is the sum of two lights; a value of red at pixel 5 is another one.
std::shared_ptr<const Levels> two_lights(float beauty_5 = 0.75f, float two_5 = 0.25f) {
    const auto but_5 = [](float v, float at_5) {
        return [=](size_t i) { return i == 5 ? at_5 : v; };
    };
    return levels_of({{"R", but_5(0.75f, beauty_5)},
                      {"G", constant(0.5f)},
                      {"B", constant(0.5f)},
                      {"A", constant(0.5f)},
                      {"one.R", constant(0.5f)},
                      {"one.G", constant(0.25f)},
                      {"one.B", constant(0.25f)},
                      {"two.R", but_5(0.25f, two_5)},
                      {"two.G", constant(0.25f)},
                      {"two.B", constant(0.25f)},
                      {"depth.Z", [](size_t i) { return float(i) / 8; }}});
}

/// The numbers as they are: 0.5 is byte 128.
ShownTile shown(const Levels& levels, const ViewMode& mode, const Look& look = {}) {
    const auto plan = mix::plan_mix(levels.stack(0), look);
    EXPECT_TRUE(plan.has_value());
    const auto transform = image::DisplayTransform::make("sRGB", "Raw");
    EXPECT_TRUE(transform.has_value());
    return show_tile({levels.stack(0), *plan, look.exposure_stops, *transform, levels.not_finite()},
                     mode, levels.frame(0));
}

std::array<int, 3> pixel(const ShownTile& tile, size_t i) {
    return {tile.rgba[4 * i], tile.rgba[4 * i + 1], tile.rgba[4 * i + 2]};
}

ViewMode layer_mode(const Levels& levels, const std::string& name) {
    for (const ShownLayer& layer : levels.shown()) {
        if (layer.name == name) return {layer};
    }
    ADD_FAILURE() << name;
    return {};
}

TEST(ShownLayers, ChannelsAreGroupedAndEveryOneIsShown) {
    const auto levels = levels_of({{"A", constant(1)},
                                   {"B", constant(0)},
                                   {"CryptoObject00.R", constant(0)},
                                   {"G", constant(0)},
                                   {"N.X", constant(0)},
                                   {"N.Y", constant(0)},
                                   {"N.Z", constant(0)},
                                   {"R", constant(0)},
                                   {"Z", constant(3)},
                                   {"light.one.B", constant(0)},
                                   {"light.one.G", constant(0)},
                                   {"light.one.R", constant(0)},
                                   {"odd.part", constant(0)}});
    std::vector<std::string> names;
    for (const ShownLayer& layer : levels->shown()) names.push_back(layer.name);
    EXPECT_EQ(names, (std::vector<std::string>{"rgba", "CryptoObject00", "N", "Z", "light.one",
                                               "odd.part"}));
    EXPECT_EQ(levels->shown()[0].channels, (std::array<std::string, 4>{"R", "G", "B", "A"}));
    EXPECT_EQ(levels->shown()[2].channels, (std::array<std::string, 4>{"N.X", "N.Y", "N.Z", ""}));
    EXPECT_EQ(levels->shown()[3].channels, (std::array<std::string, 4>{"Z", "Z", "Z", ""}));
}

TEST(ShownLayers, IntegersAreListedAndNotAveraged) {
    image::Image image;
    image.data = image.display = {0, 0, 4, 2};
    image::Part& part = image.parts.emplace_back();
    for (const char* name : {"R", "G", "B"})
        part.channels.push_back(image::Channel::make(name, image::ChannelType::Half, 8));
    image::Channel ids = image::Channel::make("objectId", image::ChannelType::Uint, 8);
    std::get<std::vector<uint32_t>>(ids.data) = {7, 9, 4294967295u, 1, 9, 9, 9, 9};
    part.channels.push_back(ids);
    auto stack = LayerStack::from_image(std::move(image), ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const auto layers = shown_layers(*stack);
    ASSERT_EQ(layers.size(), 2u);
    EXPECT_EQ(layers[1].name, "objectId");
    const image::Image half = half_size(*stack);
    EXPECT_EQ(std::get<std::vector<uint32_t>>(half.find("objectId")->data),
              (std::vector<uint32_t>{7, 4294967295u}));
}

TEST(ShownLayers, HalfImagesAreListedLast) {
    film::LayerSet set = film::test_layer_set();
    set.halves = true;
    film::Film film({0, 0, 8, 4}, set);
    film::render(film, 0, 2);
    const std::string path = film::temporary_file("shown_halves.exr");
    ASSERT_TRUE(film.write(path, {}).has_value());
    const auto stack = LayerStack::load(path);
    ASSERT_TRUE(stack.has_value());
    bool is_half = false;
    size_t halves = 0;
    for (const ShownLayer& layer : shown_layers(*stack)) {
        const accumulate::LayerEntry* entry = stack->header().find(layer.name);
        const bool is_one = entry && entry->family == "halves";
        EXPECT_TRUE(is_one || !is_half) << layer.name;
        is_half = is_half || is_one;
        halves += is_one;
    }
    EXPECT_GT(halves, 0u);
}

TEST(ViewMode, TheMixInColorIsThatOfTheCommand) {
    const auto levels = small_levels();
    const auto plan = mix::plan_mix(levels->stack(0), {});
    const auto transform = image::DisplayTransform::make("", "");
    ASSERT_TRUE(plan.has_value() && transform.has_value());
    const ShownTile tile = show_tile(
        {levels->stack(0), *plan, 0.5f, *transform, levels->not_finite()}, {}, levels->frame(0));
    EXPECT_TRUE(tile.rgba == display_rgba(mix_tile(levels->stack(0), *plan, 0.5f, levels->frame(0)),
                                          *transform));
}

TEST(ViewMode, ALayerOrChannelIsShownAlone) {
    const auto levels = two_lights();
    // ⌊255 v + ½⌋: 0.75 → 191, 0.5 → 128, 0.25 → 64
    EXPECT_EQ(pixel(shown(*levels, {}), 0), (std::array{191, 128, 128}));
    EXPECT_EQ(pixel(shown(*levels, layer_mode(*levels, "one")), 0), (std::array{128, 64, 64}));
    // Gains of the look are those of the mix alone; exposure is the screen's
    Look look;
    look.controls = {parse_control(Control::Kind::Gain, "one=0").value()};
    look.exposure_stops = 1;
    EXPECT_EQ(pixel(shown(*levels, layer_mode(*levels, "two"), look), 0),
              (std::array{128, 128, 128}));
    EXPECT_EQ(pixel(shown(*levels, {{}, ShownChannel::Red}), 0), (std::array{191, 191, 191}));
    EXPECT_EQ(pixel(shown(*levels, {{}, ShownChannel::Blue}), 0), (std::array{128, 128, 128}));
    EXPECT_EQ(pixel(shown(*levels, {{}, ShownChannel::Alpha}, look), 0),
              (std::array{128, 128, 128}))
        << "no exposure";
    // 0.2126 · 0.75 + 0.7874 · 0.5 = 0.55315 → 141
    EXPECT_EQ(pixel(shown(*levels, {{}, ShownChannel::Luminance}), 0), (std::array{141, 141, 141}));
    // A layer of one channel is gray: pixel 4 is 4 / 8
    EXPECT_EQ(pixel(shown(*levels, layer_mode(*levels, "depth")), 4), (std::array{128, 128, 128}));
    ViewMode alpha = layer_mode(*levels, "rgba");
    alpha.channel = ShownChannel::Alpha;
    EXPECT_EQ(alpha.text(), "rgba, alpha");
    EXPECT_EQ(pixel(shown(*levels, alpha), 0), (std::array{128, 128, 128}));
}

TEST(ViewMode, NotFiniteClippedAndNegativePixelsAreCountedAndMarked) {
    for (const float bad : {nan, infinite, -infinite}) {
        const auto beauty = two_lights(bad);
        EXPECT_EQ(beauty->not_finite(), std::set<std::string>{"R"});
        EXPECT_EQ(shown(*beauty, {}).flagged, (FlaggedPixels{1, 0, 0}));
        ViewMode mode;
        mode.flags_pixels = true;
        const ShownTile tile = shown(*beauty, mode);
        EXPECT_EQ(pixel(tile, 5), (std::array{255, 0, 255}));
        EXPECT_EQ(pixel(tile, 4), (std::array{191, 128, 128}));

        // A row alone. The mix of a file of another program is its beauty with what gains change
        // of rows: one that nothing changes is not in it, one that is muted is taken off
        const auto row = two_lights(0.75f, bad);
        EXPECT_EQ(row->not_finite(), std::set<std::string>{"two.R"});
        EXPECT_EQ(shown(*row, layer_mode(*row, "two")).flagged, (FlaggedPixels{1, 0, 0}));
        EXPECT_EQ(shown(*row, layer_mode(*row, "one")).flagged, FlaggedPixels());
        EXPECT_EQ(shown(*row, {}).flagged, FlaggedPixels());
        Look muted;
        muted.controls = {parse_control(Control::Kind::Mute, "two").value()};
        EXPECT_EQ(shown(*row, {}, muted).flagged, (FlaggedPixels{1, 0, 0}));
    }
    const auto levels = levels_of({{"R", [](size_t i) { return i < 3 ? 1.5f : 0.5f; }},
                                   {"G", [](size_t i) { return i == 7 ? -0.1f : 0.5f; }},
                                   {"B", constant(0.5f)}});
    ViewMode mode;
    mode.flags_pixels = true;
    const ShownTile tile = shown(*levels, mode);
    EXPECT_EQ(tile.flagged, (FlaggedPixels{0, 3, 1}));
    EXPECT_EQ(tile.flagged.text(), "3 px clipped · 1 px negative");
    EXPECT_EQ(pixel(tile, 0), (std::array{255, 60, 0}));
    EXPECT_EQ(pixel(tile, 7), (std::array{0, 90, 255}));
    // Of a channel alone what it shows
    mode.channel = ShownChannel::Blue;
    EXPECT_EQ(shown(*levels, mode).flagged, FlaggedPixels());
}

TEST(ViewMode, AGainThatOverflowsIsCounted) {
    const auto levels =
        levels_of({{"R", constant(1e30f)}, {"G", constant(0.5f)}, {"B", constant(0.5f)}});
    Look look;
    look.exposure_stops = 64;  // 1e30 · 2^64 > 3.4e38
    const ShownTile tile = shown(*levels, {}, look);
    EXPECT_EQ(tile.flagged.not_finite, 8u);
}

TEST(FlaggedPixelCounts, AreThoseOfOneImageWhole) {
    FlaggedPixelCounts counts;
    counts.take(0, 1, {0, 0, 4, 4}, {1, 0, 0});
    EXPECT_FALSE(counts.of(0, 1, 32)) << "half of it is missing";
    counts.take(0, 1, {4, 0, 8, 4}, {2, 3, 0});
    EXPECT_EQ(counts.of(0, 1, 32), (FlaggedPixels{3, 3, 0}));
    counts.take(0, 2, {0, 0, 4, 4}, {});
    EXPECT_FALSE(counts.of(0, 1, 32)) << "part of it is that of a newer picture";
    EXPECT_FALSE(counts.of(1, 1, 32));
}

TEST(Session, KeysChooseWhatOfThePixelsIsShown) {
    Session session{RecentFiles("")};
    session.show("two.exr", two_lights());
    const auto press = [&](const char* key) { session.press(*key_press_of(key)); };
    const uint64_t color = session.image(0)->version;
    press("r");
    EXPECT_EQ(session.mode().text(), "red");
    EXPECT_GT(session.image(0)->version, color) << "another picture";
    press("a");
    EXPECT_EQ(session.mode().text(), "alpha");
    press("a");
    EXPECT_EQ(session.mode().text(), "");
    press(".");
    EXPECT_EQ(session.mode().text(), "rgba");
    press(".");
    EXPECT_EQ(session.mode().text(), "one");
    // The layer of that name in another file; the mix where there is none
    session.show("three.exr", two_lights());
    EXPECT_EQ(session.mode().text(), "one");
    session.show("four.exr",
                 levels_of({{"R", constant(1)}, {"G", constant(1)}, {"B", constant(1)}}));
    EXPECT_EQ(session.mode().text(), "");
    for (int i = 0; i < 9; ++i) press(",");
    EXPECT_EQ(session.mode().text(), "");
    press("o");
    EXPECT_TRUE(session.mode().flags_pixels);
    EXPECT_FALSE(session.has_unsaved_look()) << "no part of a look";
}

TEST(Session, NotFiniteChannelsAreSaidOnOpening) {
    Session session{RecentFiles("")};
    session.show("nan.exr", two_lights(0.75f, nan));
    EXPECT_NE(session.message().text.find("NaN or Inf in two.R"), std::string::npos)
        << session.message().text;
}

}  // namespace
}  // namespace velatura::compositor::window
