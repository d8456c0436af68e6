// SPDX-License-Identifier: Apache-2.0
// Files that no program of ours writes: an error that says why, never a crash or memory without bounds.
#include "image/exr.h"
#include "image/layer_file.h"
#include "made_exr.h"
#include "temporary.h"

#include <gtest/gtest.h>

namespace velatura::image {

namespace {

const std::vector<std::string> record_channels = {"sums_first", "sums_end", "sums_invalid", "sums_primId", "sums_instanceId", "sums_hasIds"};

}  // namespace

TEST(BadExr, PartsOverOtherPixelsAreNotMixedUp) {
    const std::string path = temporary("windows.exr");
    const Window window{0, 0, 8, 6};
    // Fewer pixels; as many, but others
    for (const Window& other : {Window{0, 0, 8, 3}, {2, 0, 10, 6}, {0, 0, 6, 8}}) {
        make_exr(path, {{"rgba", window, {"R", "G", "B"}, {}, {}}, {"sums", other, {}, {}, record_channels}});
        for (const auto& image : {read_exr(path), read_layer_file(path), read_sums_image(path)}) {
            ASSERT_FALSE(image.has_value()) << other.x1 << " " << other.y1;
            EXPECT_EQ(image.error().code, "io-read");
            EXPECT_NE(image.error().message.find("data window"), std::string::npos) << image.error().message;
        }
    }
    make_exr(path, {{"rgba", window, {"R", "G", "B"}, {}, {}}, {"sums", window, {}, {}, record_channels}});
    EXPECT_TRUE(read_exr(path).has_value());
    const auto sums = read_sums_image(path);
    ASSERT_TRUE(sums.has_value());
    EXPECT_EQ(sums->parts.size(), 1u);
}

TEST(BadExr, HeaderStringsOfDeepJsonAreRefused) {
    const std::string path = temporary("deep_json.exr");
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    for (const char* name : {"velatura/sums", "velatura/split", "velatura/settings", "velatura/layers", "cryptomatte/1234567/manifest"}) {
        Image image;
        image.data = image.display = {0, 0, 2, 1};
        image.parts.push_back({"", {Channel::make("R", ChannelType::Float, 2)}, {}});
        image.attributes[name] = "{\"layerSet\": " + deep + "}";
        ASSERT_TRUE(write_exr(path, image).has_value());
        const auto read = read_exr(path);
        ASSERT_FALSE(read.has_value()) << name;
        EXPECT_EQ(read.error().code, "io-open");
        EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
        // What others write is theirs
        image.attributes = {{"comment", deep}};
        ASSERT_TRUE(write_exr(path, image).has_value());
        EXPECT_TRUE(read_exr(path).has_value());
    }
}

}  // namespace velatura::image
