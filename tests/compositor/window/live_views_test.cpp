// SPDX-License-Identifier: Apache-2.0
// What the image can be shown as while it converges: denoised, in false colors, beside snapshots;
// and rows by their light at a pixel.
#include "compositor/denoise/denoise.h"
#include "compositor/window/denoised_layers.h"
#include "compositor/window/session.h"
#include "compositor/window/tile_mix.h"
#include "image/formats.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>

namespace velatura::compositor::window {
namespace {

void press(Session& session, const char* keys) {
    const auto key = key_press_of(keys);
    ASSERT_TRUE(key.has_value()) << keys;
    session.press(*key);
}

const image::Window whole = {0, 0, 48, 33};

std::vector<uint8_t> bytes(const Session& session, size_t look = 0) {
    return session.screen_tile(look, whole).rgba;
}

float value_at(const LayerStack& stack, const std::string& name, int x, int y) {
    const image::Channel* channel = stack.image().find(name);
    EXPECT_TRUE(channel) << name;
    const image::Window& data = stack.image().data;
    return channel && data.contains(x, y) ? channel->value(data.index(x, y)) : 0;
}

TEST(FalseColor, StopsAreThoseOfTheLuminance) {
    Session session = session_of_small();
    press(session, "v");
    const auto shown = bytes(session);
    const LayerStack& stack = small_levels()->stack(0);
    const auto plan = mix::plan_gains(stack, session.look());
    ASSERT_TRUE(plan.has_value());
    const auto rgb = mix_tile(stack, *plan, 0, whole);
    for (size_t i = 0; i < whole.pixel_count(); ++i) {
        const double y = 0.2126 * double(rgb[3 * i]) + 0.7152 * double(rgb[3 * i + 1]) +
                         0.0722 * double(rgb[3 * i + 2]);
        const auto expected = scale_color(y > 0 ? float((std::log2(y / 0.18) + 6) / 12) : 0.0f);
        for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(int(shown[4 * i + c]), int(expected[c]), 1) << i;
    }
    // Two stops up: as far up the scale as two more stops are
    EXPECT_EQ(scale_of(session.image(0)->mode).front().text, "-6");
    press(session, "v");
    EXPECT_NE(bytes(session), shown);
}

TEST(FalseColor, MapsOfSamplesAndNoiseAreTheLayers) {
    Session session = session_of_small();
    const LayerStack& stack = small_levels()->stack(0);
    float most = 0;
    for (int y = 0; y < whole.y1; ++y)
        for (int x = 0; x < whole.x1; ++x)
            most = std::max(most, value_at(stack, "sampleCount", x, y));
    press(session, "k");
    ASSERT_EQ(session.look_error(), "");
    const auto samples = bytes(session);
    press(session, "n");
    ASSERT_EQ(session.look_error(), "");
    const auto noise = bytes(session);
    ASSERT_GT(most, 0);
    for (int y = 0; y < whole.y1; ++y) {
        for (int x = 0; x < whole.x1; ++x) {
            const size_t i = 4 * whole.index(x, y);
            const auto expected = scale_color(value_at(stack, "sampleCount", x, y) / most);
            const float variance = value_at(stack, "variance", x, y);
            const float mean = (value_at(stack, "R", x, y) + value_at(stack, "G", x, y) +
                                value_at(stack, "B", x, y)) /
                               3;
            const float t = variance == 0 ? 0
                            : mean > 0    ? std::log10(std::sqrt(variance) / mean) / 3 + 1
                                          : 1;
            const auto of_noise = scale_color(t);
            for (size_t c = 0; c < 3; ++c) {
                EXPECT_EQ(samples[i + c], expected[c]) << x << " " << y;
                EXPECT_NEAR(int(noise[i + c]), int(of_noise[c]), 1) << x << " " << y;
            }
        }
    }
    // A file without them says so, and the image stays
    Session plain{RecentFiles("")};
    plain.show("plain.exr", levels_of(plain_file("no_data.exr", {0, 0, 48, 33})));
    press(plain, "k");
    EXPECT_NE(plain.look_error().find("sampleCount"), std::string::npos) << plain.look_error();
    press(plain, "k");
    EXPECT_EQ(plain.look_error(), "");
}

TEST(PixelShares, AreWhatTheSoloedRowShows) {
    Session session = session_of_small();
    session.edit("", [](Look& l) { set_stops(l, "key", 1.5f); });
    session.sort_rows_at(std::array<int, 2>{20, 15});
    const PixelShares* shares = session.pixel_shares();
    ASSERT_TRUE(shares);
    const LayerStack& stack = small_levels()->stack(0);
    const auto luminance = [&](const Look& look) {
        const auto plan = mix::plan_gains(stack, look);
        const auto rgb = mix_tile(stack, *plan, 0, {20, 15, 21, 16});
        return 0.2126 * double(rgb[0]) + 0.7152 * double(rgb[1]) + 0.0722 * double(rgb[2]);
    };
    const double all = luminance(session.look());
    double sum = 0;
    for (const std::string& group : stack.group_names()) {
        Look alone = session.look();
        set_soloed(alone, group, true);
        EXPECT_NEAR(shares->of(group), luminance(alone) / all, 1e-9) << group;
        sum += shares->of(group);
    }
    // Groups share all the light, up to the halves that they are stored in
    EXPECT_NEAR(sum, 1, 2e-3);
    const auto rows = session.found(session.targets_of_page());
    ASSERT_EQ(rows.size(), session.targets_of_page().size());
    EXPECT_EQ(rows.front(), "all");
    for (size_t i = 1; i < rows.size(); ++i) {
        if (rows[i] == "env" || rows[i - 1] == "env" || rows[i - 1] == "all") continue;
        EXPECT_GE(shares->of(rows[i - 1]), shares->of(rows[i]));
    }
    // A solo does not change what lights the pixel; a mute does
    const double key = shares->of("key");
    session.edit("", [](Look& l) { set_soloed(l, "fill", true); });
    EXPECT_EQ(session.pixel_shares()->of("key"), key);
    session.edit("", [](Look& l) { set_muted(l, "key", true); });
    EXPECT_EQ(session.pixel_shares()->of("key"), 0);
    session.sort_rows_at(std::nullopt);
    EXPECT_EQ(session.found(session.targets_of_page()), session.targets_of_page());
    // By key: the pixel that the mouse was over
    press(session, "l");
    EXPECT_FALSE(session.is_sorting()) << "it was over none";
    session.hover({3, 4});
    press(session, "l");
    EXPECT_TRUE(session.is_sorting());
}

TEST(Snapshots, KeepImageAndLook) {
    Session session = session_of_small();
    session.edit("", [](Look& l) { set_muted(l, "fill", true); });
    const auto muted = bytes(session);
    press(session, "t");
    ASSERT_EQ(session.snapshots().size(), 1u);
    const Snapshot& snapshot = session.snapshots().front();
    EXPECT_EQ(snapshot.note, "2 spp");
    EXPECT_EQ(snapshot.rgba.size(), size_t(snapshot.width) * size_t(snapshot.height) * 4);
    EXPECT_EQ(snapshot.rgba, muted) << "the smallest level of a small image is the image";
    session.edit("", [](Look& l) { set_stops(l, "key", -2); });
    EXPECT_NE(bytes(session), muted);
    // More samples come: the snapshot stays what it was
    const auto later = levels_of(window_file("later.exr", {3, 2, 43, 31}, {0, 0, 48, 33}, 4));
    session.renew(later);
    session.compare_with_snapshot(0);
    EXPECT_TRUE(session.is_wiping());
    EXPECT_EQ(bytes(session, 1), muted);
    EXPECT_NE(bytes(session, 0), muted);
    const auto later_again =
        levels_of(window_file("later8.exr", {3, 2, 43, 31}, {0, 0, 48, 33}, 8));
    session.renew(later_again);
    EXPECT_EQ(bytes(session, 1), muted);
    // Its look, on what is there now
    session.use_look_of_snapshot(0);
    EXPECT_EQ(row_state(session.look(), "key").stops, 0);
    EXPECT_TRUE(row_state(session.look(), "fill").is_muted);
    session.remove_snapshot(0);
    EXPECT_TRUE(session.snapshots().empty());
    EXPECT_EQ(bytes(session, 1), muted) << "B has it still";
}

TEST(Snapshots, AreAFewAndNeverOfADraft) {
    Session session = session_of_small();
    for (int i = 0; i < 10; ++i) press(session, "t");
    ASSERT_EQ(session.snapshots().size(), Snapshots::max_count);
    EXPECT_EQ(session.snapshots().front().title, "snapshot 3");
    press(session, "shift+t");
    EXPECT_EQ(session.compared(), "snapshot 11");
    auto stack = LayerStack::load(window_file("draft.exr", {0, 0, 12, 9}, {0, 0, 12, 9}));
    ASSERT_TRUE(stack.has_value());
    auto draft =
        Levels::make_draft(std::make_shared<const LayerStack>(std::move(*stack)), 4, 48, 33);
    ASSERT_TRUE(draft.has_value());
    session.renew(std::make_shared<const Levels>(std::move(*draft)), true);
    EXPECT_FALSE(session.take_snapshot());
    EXPECT_TRUE(session.message().is_error);
}

std::shared_ptr<const Levels> large_levels(uint64_t samples) {
    // No more layers than a denoiser needs
    film::LayerSet set = film::test_layer_set();
    set.bounce_layers = false;
    film::Film film({0, 0, 480, 330}, set);
    film::render(film, 0, samples);
    const std::string path = film::temporary_file("large" + std::to_string(samples) + ".exr");
    EXPECT_TRUE(film.write(path, {}).has_value());
    return levels_of(path);
}

TEST(DenoisedLayers, AreThoseOfTheCommand) {
    const auto levels = small_levels();
    const auto shown = denoised_levels(*levels, 0);
    ASSERT_TRUE(shown.has_value()) << shown.error().message;
    EXPECT_EQ((*shown)->reduction(), 1);
    denoise::DenoiseReport report;
    const auto image = denoise::denoise(levels->stack(0), report);
    ASSERT_TRUE(image.has_value());
    for (const image::Part& part : image->parts)
        for (const image::Channel& channel : part.channels) {
            const image::Channel* same = (*shown)->stack(0).image().find(channel.name);
            ASSERT_TRUE(same) << channel.name;
            EXPECT_TRUE(same->data == channel.data) << channel.name;
        }
    // Smaller, over the same image
    const auto large = large_levels(2);
    ASSERT_GE(large->count(), 2u);
    const auto small = denoised_levels(*large, 1);
    ASSERT_TRUE(small.has_value()) << small.error().message;
    EXPECT_EQ((*small)->reduction(), 2);
    EXPECT_EQ((*small)->image_frame(), large->image_frame());
    EXPECT_EQ((*small)->frame(0), large->frame(1));
    EXPECT_FALSE(denoised_levels(**shown, 0).has_value()) << "not twice";
}

TEST(DenoisedLayers, FirstSmallThenWholeOnceNothingIsNewer) {
    DenoisedLayers denoised([] {});
    const auto first = large_levels(2), second = large_levels(4);
    const auto next = [&](bool stays) -> std::shared_ptr<const Levels> {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
        while (std::chrono::steady_clock::now() < end) {
            denoised.advance(stays);
            if (auto taken = denoised.take()) {
                EXPECT_TRUE(taken->has_value()) << taken->error().message;
                return *taken ? **taken : nullptr;
            }
            if (!denoised.is_busy()) return nullptr;
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        ADD_FAILURE() << "nothing came";
        return nullptr;
    };
    EXPECT_TRUE(denoised.is_done()) << "nothing was offered";
    denoised.offer(first);
    EXPECT_FALSE(denoised.is_done());
    const auto quick = next(false);
    ASSERT_TRUE(quick);
    EXPECT_EQ(quick->reduction(), 1 << first->quick_level());
    EXPECT_EQ(next(false), nullptr) << "it goes on: newer layers come";
    denoised.offer(second);
    ASSERT_TRUE(next(false));
    const auto at_rest = next(true);
    ASSERT_TRUE(at_rest);
    EXPECT_EQ(at_rest->reduction(), 1);
    EXPECT_TRUE(denoised.is_done());
    EXPECT_EQ(next(true), nullptr);
    denoised.clear();
    denoised.offer(first);
    EXPECT_TRUE(next(true)) << "anew";
}

}  // namespace
}  // namespace velatura::compositor::window
