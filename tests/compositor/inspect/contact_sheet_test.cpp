// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/contact_sheet.h"

#include "compositor/inspect/layer_image.h"
#include "compositor/made_layers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::inspect {
using canvas::Canvas;

namespace {

constexpr int width = 8, height = 6;

template <class F>
image::Channel channel(const char* name, image::ChannelType type, F f) {
    image::Channel c = image::Channel::make(name, type, size_t(width) * height);
    std::visit(
        [&](auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            for (int i = 0; i < width * height; ++i)
                values[size_t(i)] = Value(f(i % width, i / width));
        },
        c.data);
    return c;
}

/// A file of nobody in particular.
image::Image foreign() {
    using enum image::ChannelType;
    image::Image image;
    image.data = image.display = {0, 0, width, height};
    image::Part part;
    part.name = "all";
    const auto is_left = [](int x, int) { return x < width / 2 ? 1.0f : 0.0f; };
    const auto nothing = [](int, int) { return 0.0f; };
    const auto full = [](int, int) { return 1.0f; };
    for (const char* name : {"A", "B", "G"}) part.channels.push_back(channel(name, Float, full));
    part.channels.push_back(channel("R", Float, full));
    part.channels.push_back(channel("spill.B", Half, nothing));
    part.channels.push_back(channel("spill.G", Half, nothing));
    part.channels.push_back(channel("spill.R", Half, is_left));
    part.channels.push_back(channel("N.X", Float, full));
    part.channels.push_back(channel("N.Y", Float, nothing));
    part.channels.push_back(channel("N.Z", Float, nothing));
    part.channels.push_back(
        channel("primId", Uint, [](int x, int) { return x < 4 ? 7u : 4294967295u; }));
    part.channels.push_back(
        channel("sampleCount", Uint, [](int x, int) { return x < 4 ? 1u : 9u; }));
    image.parts.push_back(std::move(part));
    return image;
}

SheetOptions raw() {
    SheetOptions options;
    options.view = "Raw";
    options.cell_width = 40;
    options.columns = 2;
    return options;
}

Canvas::Color pixel(const Canvas& sheet, int x, int y) {
    const float* p = &sheet.rgb()[3 * (size_t(y) * size_t(sheet.width()) + size_t(x))];
    return {p[0], p[1], p[2]};
}

TEST(ContactSheet, TakesAnyFileApartIntoLayers) {
    const image::Image image = foreign();
    const auto layers = layers_of(image);
    std::vector<std::string> names;
    for (const auto& l : layers) names.push_back(l.name);
    EXPECT_EQ(names, (std::vector<std::string>{"rgba", "spill", "N", "primId", "sampleCount"}));
    EXPECT_EQ(layers[1].channels[0]->name, "spill.R");
    using Kind = LayerChannels::Kind;
    EXPECT_EQ(layers[1].kind(), Kind::Light);
    EXPECT_EQ(layers[2].kind(), Kind::Direction);
    EXPECT_EQ(layers[3].kind(), Kind::Ids);
    EXPECT_EQ(layers[4].kind(), Kind::Scalar);
    EXPECT_NEAR(mean_luminance(layers[1]), 0.2126 / 2, 1e-12);
    EXPECT_NEAR(fitting_stops(layers[1]), std::log2(0.8 / 0.2126), 1e-6);
}

TEST(ContactSheet, ShowsEveryLayerWhereItBelongs) {
    // Cells of 40 by 30, 12 apart, with 20 above them for the name: columns at 12 and 64, rows from
    // 32 on every 62
    const auto sheet = contact_sheet(foreign(), raw());
    ASSERT_TRUE(sheet.has_value()) << sheet.error().message;
    EXPECT_EQ(sheet->width(), 116);
    EXPECT_EQ(sheet->height(), 3 * 62 + 12);
    EXPECT_EQ(pixel(*sheet, 20, 40), (Canvas::Color{1, 1, 1}));                // the beauty
    EXPECT_EQ(pixel(*sheet, 64 + 5, 40), (Canvas::Color{1, 0, 0}));            // spill, left
    EXPECT_EQ(pixel(*sheet, 64 + 35, 40), (Canvas::Color{0, 0, 0}));           // and right
    EXPECT_EQ(pixel(*sheet, 20, 40 + 62), (Canvas::Color{1, 0.5f, 0.5f}));     // N
    EXPECT_EQ(pixel(*sheet, 64 + 35, 40 + 62), (Canvas::Color{0, 0, 0}));      // no prim
    EXPECT_NE(pixel(*sheet, 64 + 5, 40 + 62), (Canvas::Color{0, 0, 0}));       // prim 7
    EXPECT_EQ(pixel(*sheet, 12 + 35, 40 + 2 * 62), (Canvas::Color{1, 1, 1}));  // most samples
    bool has_text = false;
    for (int x = 12; x < 52; ++x) {
        for (int y = 12; y < 28; ++y) has_text = has_text || pixel(*sheet, x, y)[0] > 0.9f;
    }
    EXPECT_TRUE(has_text);
}

/// What the caption states of a heat map.
TEST(ContactSheet, HeatMapsStateTheirRange) {
    const image::Image image = foreign();
    for (const LayerChannels& layer : layers_of(image)) {
        const auto range = shown_range(layer);
        ASSERT_EQ(range.has_value(), layer.name == "sampleCount") << layer.name;
        if (!range) continue;
        EXPECT_EQ(range->low, 1.0f);
        EXPECT_EQ(range->high, 9.0f);
    }
}

TEST(ContactSheet, ShowsMattesByTheirIds) {
    image::Image image = foreign();
    image.parts[0].channels.clear();
    using image::ChannelType::Float;
    image.parts[0].channels.push_back(
        channel("CryptoObject00.R", Float, [](int x, int) { return x < 4 ? 1.5e-12f : 3.0e7f; }));
    image.parts[0].channels.push_back(
        channel("CryptoObject00.G", Float, [](int, int y) { return y < 3 ? 1.0f : 0.0f; }));
    const auto sheet = contact_sheet(image, raw());
    ASSERT_TRUE(sheet.has_value());
    const Canvas::Color left = pixel(*sheet, 17, 40), right = pixel(*sheet, 47, 40);
    EXPECT_NE(left, right);
    EXPECT_NE(left, (Canvas::Color{0, 0, 0}));
    EXPECT_EQ(pixel(*sheet, 17, 58), (Canvas::Color{0, 0, 0}));
}

/// Of a light layer of the header, channels may be gone.
TEST(ContactSheet, LayersThatAreNotWholeAreNoLight) {
    image::Image image = made_layers();
    std::erase_if(image.parts[1].channels, [](const image::Channel& c) {
        return c.name == "b1_key.G" || c.name == "b1_key.B" || c.name == "tail_key.B";
    });
    using Kind = LayerChannels::Kind;
    for (const LayerChannels& layer : layers_of(image)) {
        if (layer.name == "b0_key") {
            EXPECT_EQ(layer.kind(), Kind::Light);
        }
        if (layer.name == "b1_key") {
            EXPECT_EQ(layer.kind(), Kind::Scalar);
        }
    }
    SheetOptions options = raw();
    options.fit = true;
    EXPECT_TRUE(contact_sheet(image, options).has_value());
    // Red, green and alpha are no color either
    std::erase_if(image.parts[0].channels, [](const image::Channel& c) { return c.name == "B"; });
    EXPECT_EQ(layers_of(image)[0].kind(), Kind::Scalar);
    EXPECT_TRUE(contact_sheet(image, options).has_value());
}

/// As Arnold and Nuke write parts: each has channels R, G and B.
TEST(ContactSheet, PartsWithTheSameChannelsAreLayersOfTheirOwn) {
    const auto layers = layers_of(made_foreign({{"RGBA", {"R", "G", "B", "A"}},
                                                {"RGBA_key", {"R", "G", "B"}},
                                                {"left", {"N.X", "N.Y", "N.Z"}},
                                                {"right", {"N.X", "N.Y", "N.Z"}}}));
    std::vector<std::string> names;
    for (const LayerChannels& l : layers) names.push_back(l.name);
    EXPECT_EQ(names, (std::vector<std::string>{"rgba", "RGBA_key", "N", "right.N"}));
    for (const LayerChannels& l : layers)
        EXPECT_EQ(l.channels.size(), l.name == "rgba" ? 4u : 3u) << l.name;
}

TEST(ContactSheet, PatternsAndExposure) {
    SheetOptions options = raw();
    options.patterns = {"sp*"};
    options.exposure_stops = -2;
    const auto sheet = contact_sheet(foreign(), options);
    ASSERT_TRUE(sheet.has_value());
    EXPECT_EQ(sheet->height(), 62 + 12);
    EXPECT_EQ(pixel(*sheet, 15, 40), (Canvas::Color{0.25f, 0, 0}));
    options.patterns = {"moon"};
    EXPECT_EQ(contact_sheet(foreign(), options).error().code, "no-layers");
}

TEST(ContactSheet, HalvesOfTheLayersThatWereAskedFor) {
    const image::Image image = made_foreign(
        {{"", {"R", "G", "B", "C_key.R", "C_key_hA.R", "C_key_hB.R", "C_sky.R", "C_sky_hA.R"}}});
    const auto rows = [&](std::vector<std::string> patterns, bool halves) {
        SheetOptions options = raw();
        options.columns = 1;
        options.patterns = std::move(patterns);
        options.halves = halves;
        const auto sheet = contact_sheet(image, options);
        // Cells of 40 by 23, with 32 above them
        return sheet ? (sheet->height() - 12) / 55 : 0;
    };
    EXPECT_EQ(rows({}, false), 3);
    EXPECT_EQ(rows({}, true), 6);
    EXPECT_EQ(rows({"C_key"}, false), 1);
    EXPECT_EQ(rows({"C_key"}, true), 3);
    EXPECT_EQ(rows({"C_*_hA"}, false), 2);
    EXPECT_EQ(rows({"C_*_hA"}, true), 2);
    EXPECT_EQ(rows({"C_*"}, false), 2);
    EXPECT_EQ(rows({"C_*"}, true), 5);
    EXPECT_EQ(rows({"C_key_h?"}, false), 2);
}

/// Thousands of layers get small cells, and more than a sheet can hold an error.
TEST(ContactSheet, StaysWithinBounds) {
    image::Image image = foreign();
    image::Part& part = image.parts[0];
    for (int i = 0; i < 900; ++i)
        part.channels.push_back(channel(("layer" + std::to_string(i)).c_str(),
                                        image::ChannelType::Float,
                                        [](int x, int) { return float(x); }));
    SheetOptions options;
    options.view = "Raw";
    const auto sheet = contact_sheet(image, options);
    ASSERT_TRUE(sheet.has_value());
    EXPECT_LE(double(sheet->width()) * sheet->height(), 128e6);
    options.columns = 1;
    EXPECT_EQ(contact_sheet(image, options).error().code, "sheet-too-large");
}

}  // namespace
}  // namespace velatura::compositor::inspect
