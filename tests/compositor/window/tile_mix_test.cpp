// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/tile_mix.h"

#include "compositor/made_layers.h"
#include "compositor/window/pixel_readout.h"
#include "image/formats.h"
#include "window_stack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::compositor::window {
namespace {

using Kind = Control::Kind;

Look strong_look() {
    Look look;
    for (const auto& [kind, text] : {std::pair{Kind::Gain, "key=+1.37st"},
                                     {Kind::Tint, "fill=1,.9,.35"},
                                     {Kind::Kelvin, "sky=3200"},
                                     {Kind::Gain, "indirect=0.6"},
                                     {Kind::Gain, "key:b2=+2st"},
                                     {Kind::Shadow, "key=0.4"},
                                     {Kind::Mute, "emissive"}})
        look.controls.push_back(*parse_control(kind, text));
    look.exposure_stops = 0.45f;
    return look;
}

TEST(TileMix, IsApplyMixBitForBit) {
    const LayerStack& stack = small_levels()->stack(0);
    for (const Look& look : {Look(), strong_look()}) {
        const auto plan = mix::plan_mix(stack, look);
        ASSERT_TRUE(plan.has_value());
        const image::Image whole = mix::apply_mix(stack, *plan, look, false);
        for (const image::Window& tile :
             {image::Window{0, 0, 48, 33}, {5, 7, 6, 8}, {17, 0, 48, 12}}) {
            const std::vector<float> rgb = mix_tile(stack, *plan, look.exposure_stops, tile);
            for (int y = tile.y0; y < tile.y1; ++y) {
                for (int x = tile.x0; x < tile.x1; ++x) {
                    for (size_t c = 0; c < 3; ++c) {
                        const float expected =
                            whole.data.contains(x, y)
                                ? whole.parts[0].channels[c].value(whole.data.index(x, y))
                                : 0.0f;
                        ASSERT_EQ(rgb[3 * tile.index(x, y) + c], expected) << x << ' ' << y;
                    }
                }
            }
        }
    }
}

TEST(TileMix, KeepsToMattes) {
    const LayerStack& stack = small_levels()->stack(0);
    const std::string path = film::temporary_file("matte.exr");
    ASSERT_TRUE(write_matte(path, stack).has_value());
    Look look = strong_look();
    for (const size_t i : {size_t(0), size_t(5)}) look.controls[i].matte = path + ":M";
    const auto plan = mix::plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const image::Image whole = mix::apply_mix(stack, *plan, look, false);
    const image::Window tile = {7, 3, 40, 30};
    const std::vector<float> rgb = mix_tile(stack, *plan, look.exposure_stops, tile);
    for (int y = tile.y0; y < tile.y1; ++y) {
        for (int x = tile.x0; x < tile.x1; ++x) {
            for (size_t c = 0; c < 3; ++c)
                ASSERT_EQ(rgb[3 * tile.index(x, y) + c],
                          whole.parts[0].channels[c].value(whole.data.index(x, y)));
        }
    }
    // A matte of a smaller level is as small
    const auto levels = levels_of(window_file("mattes.exr", {0, 0, 200, 110}, {}, 1));
    mix::MixPlan matted;
    matted.mattes.push_back(
        {"", std::make_shared<const std::vector<float>>(size_t(200 * 110), 0.25f)});
    const auto plans = plans_by_level(*levels, matted);
    ASSERT_EQ(plans.size(), 2u);
    EXPECT_EQ(*plans[1]->mattes[0].values, std::vector<float>(size_t(100 * 55), 0.25f));
}

#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
TEST(TileMix, ShowsTheBytesOfTheWrittenImage) {
    const LayerStack& stack = small_levels()->stack(0);
    const Look look = strong_look();
    const auto plan = mix::plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value());
    const std::string path = film::temporary_file("shown.png");
    ASSERT_TRUE(
        mix::write_display(path, mix::apply_mix(stack, *plan, look, false), look).has_value());
    const auto image = image::read_rgb_image(path, image::SourceColorSpace::Raw);
    ASSERT_TRUE(image.has_value());
    const auto transform =
        image::DisplayTransform::make(look.display, look.view, *image::color_of(stack.image()));
    ASSERT_TRUE(transform.has_value());
    const auto rgba =
        display_rgba(mix_tile(stack, *plan, look.exposure_stops, {0, 0, 48, 33}), *transform);
    ASSERT_EQ(rgba.size() / 4, image->pixels.size() / 3);
    for (size_t i = 0; i < rgba.size() / 4; ++i) {
        EXPECT_EQ(rgba[4 * i + 3], 255);
        for (size_t c = 0; c < 3; ++c)
            ASSERT_EQ(int(rgba[4 * i + c]), int(std::lround(image->pixels[3 * i + c] * 255)));
    }
}
#endif

TEST(PixelReadout, ItsLayersAddUpToTheMix) {
    const LayerStack& stack = small_levels()->stack(0);
    const Look look = strong_look();
    const auto plan = mix::plan_mix(stack, look);
    ASSERT_TRUE(plan.has_value());
    const PixelReadout pixel = read_pixel(stack, *plan, look.exposure_stops, 20, 11);
    std::array<float, 3> sum{};
    bool has_shadow = false;
    for (const PixelReadout::Layer& layer : pixel.layers) {
        has_shadow = has_shadow || (layer.name == "S_key" && layer.gain[0] > 0);
        for (size_t c = 0; c < 3; ++c) sum[c] += layer.gain[c] * layer.stored[c];
    }
    EXPECT_EQ(sum, pixel.mix);
    EXPECT_TRUE(has_shadow);
    const image::Image& image = stack.image();
    const size_t at = image.data.index(20, 11);
    for (const PixelReadout::Layer& layer : pixel.layers) {
        for (size_t c = 0; c < 3; ++c)
            EXPECT_EQ(layer.stored[c], stack.channel(layer.name, c)->value(at)) << layer.name;
    }
    for (const PixelReadout::Data& data : pixel.data) {
        if (data.name == "N") {
            EXPECT_EQ(data.values.size(), 3u);
        } else if (data.name == "Z") {
            EXPECT_EQ(data.values, std::vector<float>{image.find("Z")->value(at)});
        }
    }
}

TEST(PixelReadout, AgreesWithTheImageWithinMattesAndClamps) {
    // A matte that is neither 0 nor 1, and light that a clamp took whole, within it and everywhere
    const auto stack = LayerStack::from_image(made_layers());
    ASSERT_TRUE(stack.has_value());
    const std::string matte = film::temporary_file("readout_matte.exr");
    ASSERT_TRUE(write_matte(matte, *stack).has_value());
    Look look;
    for (const auto& [kind, text] : {std::pair{Kind::Gain, "key=+2st"},
                                     {Kind::Clamp, "fill=0.75"},
                                     {Kind::Shadow, "key=0.5"},
                                     {Kind::Tint, "fill=1,.5,.25"},
                                     {Kind::Clamp, "all=0.5"}})
        look.controls.push_back(*parse_control(kind, text));
    for (size_t i = 0; i < 3; ++i) look.controls[i].matte = matte + ":M";
    look.exposure_stops = 0.3f;
    const auto plan = mix::plan_mix(*stack, look);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const image::Image mixed = mix::apply_mix(*stack, *plan, look, false);
    bool is_given_back = false;
    for (const auto& [x, y] : {std::pair{0, 0}, {5, 0}, {17, 9}, {36, 20}}) {
        const PixelReadout pixel = read_pixel(*stack, *plan, look.exposure_stops, x, y);
        for (size_t c = 0; c < 3; ++c) {
            float sum = 0;
            for (const PixelReadout::Layer& layer : pixel.layers) {
                sum += layer.gain[c] * layer.stored[c];
                is_given_back =
                    is_given_back || (layer.name == "clamp_b0_fill" && layer.gain[c] > 0);
            }
            const float image = mixed.parts[0].channels[c].value(mixed.data.index(x, y));
            EXPECT_EQ(pixel.mix[c], image);
            EXPECT_NEAR(sum, image, 1e-5f * image) << x << ' ' << y;
        }
    }
    EXPECT_TRUE(is_given_back);
}

TEST(PixelReadout, OutsideWhatIsStoredIsBlack) {
    const LayerStack& stack = small_levels()->stack(0);
    const auto plan = mix::plan_mix(stack, {});
    const PixelReadout pixel = read_pixel(stack, *plan, 0, 0, 0);
    EXPECT_EQ(pixel.mix, (std::array<float, 3>{}));
    EXPECT_EQ(pixel.alpha, 0);
}

}  // namespace

TEST(PixelReadout, SaysNumbersOfDataAsTheyAre) {
    EXPECT_EQ(data_text({0.25f, -1.5f, 1234.5678f}), "0.25 -1.5 1235");
    // Ids have all their digits, and nothing has none
    EXPECT_EQ(data_text({123456.0f}), "123456");
    EXPECT_EQ(data_text({float(0xffffffffu)}), "none");
    EXPECT_EQ(data_text({std::numeric_limits<float>::infinity(), 1e20f}), "inf 1e+20");
}

}  // namespace velatura::compositor::window
