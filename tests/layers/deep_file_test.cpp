// SPDX-License-Identifier: Apache-2.0
#include "layers/deep_file.h"

#include "base/atomic_file.h"
#include "image/exr.h"
#include "temporary.h"

#include <gtest/gtest.h>

#include <cstring>

namespace velatura::image {

namespace {

layers::DeepImage some_deep_image() {
    layers::DeepImage image;
    image.data = {2, 1, 5, 3};
    image.display = {0, 0, 6, 4};
    image.counts = {0, 2, 1, 0, 0, 3};
    for (int i = 0; i < 6; ++i)
        image.samples.push_back({float(i), float(i) + 0.5f, 0.25f, 1.0f, 2.0f, float(-i)});
    return image;
}

}  // namespace

TEST(DeepFile, KeepsSamplesAndAttributesOfEveryKind) {
    layers::DeepImage image = some_deep_image();
    Matrix44 matrix{};
    for (size_t i = 0; i < matrix.size(); ++i) matrix[i] = float(i);
    image.attributes = {{"software", std::string("velatura")},
                        {"number", 7},
                        {"part", 0.5f},
                        {"framesPerSecond", 24.0},
                        {"centre", std::array<float, 2>{1, 2}},
                        {"worldToCamera", matrix},
                        {"chromaticities",
                         Chromaticities{0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f}}};
    const std::string path = temporary("deep.exr");
    const auto written = layers::write_deep_file(path, image);
    ASSERT_TRUE(written.has_value()) << written.error().message;
    const auto back = layers::read_deep_file(path);
    ASSERT_TRUE(back.has_value()) << back.error().message;
    EXPECT_EQ(back->data, image.data);
    EXPECT_EQ(back->display, image.display);
    EXPECT_EQ(back->counts, image.counts);
    EXPECT_EQ(back->samples, image.samples);
    EXPECT_TRUE(back->attributes == image.attributes);
}

TEST(DeepFile, FlatImagesAreRefused) {
    Image flat;
    flat.data = flat.display = {0, 0, 2, 1};
    flat.parts.push_back({"", {Channel::make("R", ChannelType::Float, 2)}, {}});
    const std::string path = temporary("flat.exr");
    ASSERT_TRUE(write_exr(path, flat).has_value());
    EXPECT_EQ(layers::read_deep_file(path).error().code, "io-open");
}

TEST(DeepFile, PixelsThatTheFileCannotHoldAreRefused) {
    const std::string path = temporary("deep_promises.exr");
    ASSERT_TRUE(layers::write_deep_file(path, some_deep_image()).has_value());
    std::string bytes = *read_file(path);
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const size_t at = bytes.find(name);
    ASSERT_NE(at, std::string::npos);
    for (const int32_t side : {3000000, 1000000000}) {
        std::memcpy(bytes.data() + at + name.size() + 8, &side, 4);
        ASSERT_TRUE(write_file_atomically(path, bytes).has_value());
        const auto deep = layers::read_deep_file(path);
        ASSERT_FALSE(deep.has_value());
        EXPECT_NE(deep.error().message.find("cannot hold"), std::string::npos)
            << deep.error().message;
    }
}

}  // namespace velatura::image
