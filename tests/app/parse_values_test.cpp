// SPDX-License-Identifier: Apache-2.0
#include "app/parse_values.h"

#include "app/frame_settings.h"

#include <gtest/gtest.h>

namespace velatura::app {

TEST(ParseDuration, Units) {
    EXPECT_EQ(*parse_duration("90"), 90.0);
    EXPECT_EQ(*parse_duration("1.5m"), 90.0);
    EXPECT_EQ(*parse_duration("2h"), 7200.0);
    for (const char* text : {"", "m", "-1", "0", "0m", "1d", "1 s"})
        EXPECT_FALSE(parse_duration(text)) << text;
}

TEST(ParseFraction, PercentOrNumber) {
    EXPECT_DOUBLE_EQ(*parse_fraction("1%"), 0.01);
    EXPECT_DOUBLE_EQ(*parse_fraction("0.25"), 0.25);
    for (const char* text : {"x%", "20", "1", "0", "-1%", "100%"})
        EXPECT_FALSE(parse_fraction(text)) << text;
}

TEST(ParseSize, PowersOfTenAndTwoAndParts) {
    EXPECT_EQ(*parse_size("800M", 0), 800'000'000u);
    EXPECT_EQ(*parse_size("1.5GB", 0), 1'500'000'000u);
    EXPECT_EQ(*parse_size("2GiB", 0), size_t(2) << 30);
    EXPECT_EQ(*parse_size("3e2KiB", 0), 300u << 10);
    EXPECT_EQ(*parse_size("1T", 0), 1'000'000'000'000u);
    EXPECT_EQ(*parse_size("50%", 3000), 1500u);
    for (const char* text :
         {"", "8", "G", "-1G", "0M", "1 G", "1Q", "1Gi", "1GBB", "nanG", "1e30T", "0%", "1%", "%"})
        EXPECT_FALSE(parse_size(text, 1)) << text;
}

TEST(ParseSampleRange, HalfOpen) {
    EXPECT_EQ(*parse_sample_range("0:32"), (std::pair<uint64_t, uint64_t>(0, 32)));
    for (const char* text : {"5:5", "6:5", "5", ":5", "5:", "-1:5", "0:99999999999"})
        EXPECT_FALSE(parse_sample_range(text)) << text;
}

TEST(DataWindow, PixelsWhoseCenterIsInside) {
    scene::RenderSettings s;
    s.width = 100;
    s.height = 50;
    EXPECT_EQ(data_window(s, {}), (image::Window{0, 0, 100, 50}));
    // NDC counts from the bottom, rows from the top
    EXPECT_EQ(data_window(s, {0.0, 0.5, 0.0, 0.5}), (image::Window{0, 25, 50, 50}));
    // Neighboring crops share no pixel and leave none out
    EXPECT_EQ(data_window(s, {0.0, 0.333, 0.0, 1.0}).x1, data_window(s, {0.333, 1.0, 0.0, 1.0}).x0);
    s.data_window_ndc = {-0.25, -0.5, 1.25, 1.0};
    EXPECT_EQ(data_window(s, {}), (image::Window{-25, 0, 125, 75})) << "overscan";
    s.data_window_ndc = {0.25, 0.0, 0.75, 1.0};
    EXPECT_EQ(data_window(s, {0.5, 1.0, 0.0, 1.0}), (image::Window{50, 0, 75, 50}));
}

}  // namespace velatura::app
