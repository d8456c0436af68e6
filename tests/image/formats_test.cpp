// SPDX-License-Identifier: Apache-2.0
#include "image/formats.h"

#include "base/atomic_file.h"
#include "image/display.h"
#include "image/exr.h"
#include "temporary.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <latch>
#include <thread>

namespace velatura::image {
namespace {

float srgb_from_linear(float v) {
    return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

class ReadRgbImage : public testing::Test {
  protected:
    void SetUp() override {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
        GTEST_SKIP() << "built without the plugin openimageio";
#endif
    }
};

using WriteDisplayImage = ReadRgbImage;

TEST_F(ReadRgbImage, TakesFloatFilesAsLinear) {
    Image image;
    image.data = image.display = {0, 0, 3, 2};
    Part part;
    for (const char* name : {"R", "G", "B"})
        part.channels.push_back(Channel::make(name, ChannelType::Float, 6));
    std::get<std::vector<float>>(part.channels[0].data) = {0, 1, 2, 3, 4, 1e6f};
    std::get<std::vector<float>>(part.channels[2].data)[4] = std::nanf("");
    image.parts.push_back(part);
    ASSERT_TRUE(write_exr(temporary("float.exr"), image).has_value());
    size_t faults = 0;
    const auto read = read_rgb_image(temporary("float.exr"), SourceColorSpace::Auto, {}, &faults);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->width, 3);
    EXPECT_EQ(read->height, 2);
    EXPECT_EQ(read->pixels[3 * 5], 1e6f);
    EXPECT_EQ(read->pixels[3 * 2], 2.0f);
    EXPECT_EQ(faults, 1u);
}

// The first image opens the library, whichever thread comes with it
TEST_F(ReadRgbImage, MayBeginInManyThreadsAtOnce) {
    Image image;
    image.data = image.display = {0, 0, 3, 2};
    Part& part = image.parts.emplace_back();
    for (const char* name : {"R", "G", "B"}) {
        part.channels.push_back(Channel::make(name, ChannelType::Float, 6));
        std::get<std::vector<float>>(part.channels.back().data) = {0, 1, 2, 3, 4, 5};
    }
    ASSERT_TRUE(write_exr(temporary("shared.exr"), image).has_value());
    constexpr size_t thread_count = 8;
    std::latch start(thread_count);
    std::vector<float> last(thread_count, -1.0f);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < thread_count; ++i) {
        threads.emplace_back([&, i] {
            start.arrive_and_wait();
            const auto read = read_rgb_image(temporary("shared.exr"));
            if (read) last[i] = read->pixels.back();
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(last, std::vector<float>(thread_count, 5.0f));
}

TEST_F(ReadRgbImage, DecodesEightBitAsSrgbUnlessRaw) {
    std::vector<float> rgb;
    for (int i = 0; i < 256; ++i) rgb.insert(rgb.end(), 3, float(i) / 255.0f);
    ASSERT_TRUE(write_display_image(temporary("ramp.png"), 256, 1, rgb).has_value());
    const auto decoded = read_rgb_image(temporary("ramp.png"));
    const auto raw = read_rgb_image(temporary("ramp.png"), SourceColorSpace::Raw);
    ASSERT_TRUE(decoded.has_value() && raw.has_value());
    for (size_t i = 0; i < 256; ++i) {
        EXPECT_NEAR(raw->pixels[3 * i], float(i) / 255.0f, 1e-6f);
        EXPECT_NEAR(srgb_from_linear(decoded->pixels[3 * i]), float(i) / 255.0f, 2e-6f);
    }
}

TEST_F(ReadRgbImage, RefusesWhatIsMissingTooLargeOrNoImage) {
    EXPECT_EQ(read_rgb_image(temporary("none.png")).error().code, "image-open");
    ASSERT_TRUE(write_file_atomically(temporary("text.png"), "hello").has_value());
    EXPECT_FALSE(read_rgb_image(temporary("text.png")).has_value());
    ASSERT_TRUE(write_display_image(temporary("wide.png"), 64, 1, std::vector<float>(192, 0.5f))
                    .has_value());
    ReadLimits limits;
    limits.max_side = 63;
    EXPECT_EQ(read_rgb_image(temporary("wide.png"), SourceColorSpace::Auto, limits).error().code,
              "image-too-large");
}

/// A pipe without a writer would be waited for, a device may never end, and some formats are made
/// from their name alone.
TEST_F(ReadRgbImage, RefusesWhatIsNoRegularFile) {
    const std::string pipe = temporary("pipe.png");
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    for (const std::string& name :
         {pipe, std::string("/dev/zero"), std::string("/dev"), temporary("made.null?RES=16x16")}) {
        const auto read = read_rgb_image(name);
        ASSERT_FALSE(read.has_value()) << name;
        EXPECT_EQ(read.error().code, "image-open") << name;
    }
}

TEST_F(WriteDisplayImage, LeavesNothingWhereItCannotWrite) {
    EXPECT_EQ(write_display_image("/dev/null/a.png", 1, 1, {0, 0, 0}).error().code, "io-write");
    const std::string path = temporary("unknown.format");
    EXPECT_EQ(write_display_image(path, 1, 1, {0, 0, 0}).error().code, "io-write");
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(DisplayTransform, PlainViewIsTheSrgbCurve) {
    ASSERT_EQ(unsetenv("OCIO"), 0);
    const auto t = DisplayTransform::make("sRGB", "sRGB");
    ASSERT_TRUE(t.has_value()) << t.error().message;
    std::vector<float> rgb = {0, 0, 0, 0.18f, 0.18f, 0.18f, 1, 1, 1, 0.5f, 0.1f, 0.02f};
    const std::vector<float> in = rgb;
    t->apply(rgb);
    for (size_t i = 0; i < rgb.size(); ++i)
        EXPECT_NEAR(rgb[i], srgb_from_linear(in[i]), 2e-4f) << i;
}

TEST(DisplayTransform, RawViewChangesNothing) {
    const auto t = DisplayTransform::make("sRGB", "Raw");
    ASSERT_TRUE(t.has_value()) << t.error().message;
    std::vector<float> rgb = {0.25f, 3.0f, 0.1f};
    t->apply(rgb);
    EXPECT_EQ(rgb, (std::vector<float>{0.25f, 3.0f, 0.1f}));
}

TEST(DisplayTransform, AcesViewHitsThePublishedAnchors) {
    const auto t = DisplayTransform::make("", "");
    ASSERT_TRUE(t.has_value()) << t.error().message;
    // ACES 1.0 maps scene 0.18 to 4.8 and 16.3 to 48 of 48 cd/m² (SMPTE S-2013-001 and the ODT's
    // tone scale)
    const std::vector<std::pair<float, float>> anchors = {{0.18f, srgb_from_linear(0.1f)},
                                                          {16.3f, 1.0f}};
    for (const auto& [scene, shown] : anchors) {
        std::vector<float> rgb = {scene, scene, scene};
        t->apply(rgb);
        for (const float v : rgb) EXPECT_NEAR(v, shown, 0.01f) << scene;
    }
}

TEST(DisplayTransform, ListsTheViewsWhenAskedForAnother) {
    const auto t = DisplayTransform::make("sRGB", "Filmic");
    ASSERT_FALSE(t.has_value());
    EXPECT_EQ(t.error().code, "ocio-view");
    EXPECT_NE(t.error().message.find("sRGB / ACES"), std::string::npos);
}

}  // namespace
}  // namespace velatura::image
