// SPDX-License-Identifier: Apache-2.0
// Files that no program of ours writes: an error that says why, never a crash or memory without
// bounds.
#include "base/atomic_file.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"
#include "layers/deep_file.h"
#include "layers/layer_file.h"
#include "layers/sums_reader.h"
#include "made_exr.h"
#include "temporary.h"

#include <ImfCompression.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <tuple>
#include <utility>

namespace velatura::image {

namespace {

const std::vector<std::string> record_channels = {"sums_first",  "sums_end",        "sums_invalid",
                                                  "sums_primId", "sums_instanceId", "sums_hasIds"};

/// Overwrites the data windows of all parts of a file.
void set_windows(const std::string& path, const Window& window) {
    std::string bytes = *read_file(path);
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const std::array<int32_t, 4> numbers = {window.x0, window.y0, window.x1 - 1, window.y1 - 1};
    for (size_t at = bytes.find(name); at != std::string::npos; at = bytes.find(name, at + 1))
        std::memcpy(bytes.data() + at + name.size(), numbers.data(), sizeof(numbers));
    ASSERT_TRUE(write_file_atomically(path, bytes).has_value());
}

/// Lets the first attribute of this name and type say that it has so many bytes more.
void lengthen(const std::string& path,
              std::string bytes,
              const std::string& name,
              const std::string& type,
              uint32_t more) {
    const std::string start = name + '\0' + type + '\0';
    const size_t at = bytes.find(start) + start.size();
    uint32_t size = 0;
    std::memcpy(&size, bytes.data() + at, sizeof size);
    size += more;
    std::memcpy(bytes.data() + at, &size, sizeof size);
    EXPECT_TRUE(write_file_atomically(path, bytes).has_value());
}

}  // namespace

TEST(BadExr, PartsOverOtherPixelsAreNotMixedUp) {
    const std::string path = temporary("windows.exr");
    const Window window{0, 0, 8, 6};
    // Fewer pixels; as many, but others
    for (const Window& other : {Window{0, 0, 8, 3}, {2, 0, 10, 6}, {0, 0, 6, 8}}) {
        make_exr(path, {{"rgba", window, {"R", "G", "B"}, {}, {}},
                        {"sums", other, {}, {}, record_channels}});
        const auto image = read_exr(path);
        const auto sums = layers::SumsReader::open(path);
        for (const Error& error : {image.error(), sums.error()}) {
            EXPECT_EQ(error.code, "io-read") << other.x1 << " " << other.y1;
            EXPECT_NE(error.message.find("data window"), std::string::npos) << error.message;
        }
        // Layers are placed, sums are not
        const auto layers = layers::read_layer_file(path);
        ASSERT_TRUE(layers.has_value()) << layers.error().message;
        EXPECT_EQ(layers->data, window);
        EXPECT_TRUE(layers->parts[1].channels.empty());
    }
    make_exr(path, {{"rgba", window, {"R", "G", "B"}, {}, {}},
                    {"sums", window, {}, {}, record_channels}});
    EXPECT_TRUE(read_exr(path).has_value());
    auto sums = layers::SumsReader::open(path);
    ASSERT_TRUE(sums.has_value());
    const auto strip = sums->read_to(window.y1);
    ASSERT_TRUE(strip.has_value());
    EXPECT_EQ(strip->parts.size(), 1u);
}

const std::vector<Imf::Compression> compressions = {
    Imf::NO_COMPRESSION,   Imf::RLE_COMPRESSION,   Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
    Imf::PIZ_COMPRESSION,  Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION,  Imf::B44A_COMPRESSION,
    Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION};

TEST(BadExr, WhatCompressesBestIsStillRead) {
    // One value in all pixels: nothing takes less of a file
    const std::string path = temporary("constant.exr");
    for (const Imf::Compression compression : compressions) {
        for (const Window& window : {Window{0, 0, 800, 600}, {-3, 4, -2, 6}}) {
            make_exr(
                path,
                {{"halves", window, {"A", "R", "G", "B"}, {}, {}, compression},
                 {"numbers", window, {}, {"x.A", "x.R", "x.G", "x.B", "Z"}, {"id"}, compression}});
            const auto image = read_exr(path);
            ASSERT_TRUE(image.has_value()) << compression << ": " << image.error().message;
            EXPECT_EQ(image->find("id")->value(0), 1.0f);
        }
    }
}

TEST(ExrParts, HaveTheirOwnCompressionUnlessThereIsToBeNone) {
    const std::string path = temporary("parts.exr");
    Image image;
    image.data = image.display = {0, 0, 40, 30};
    for (const char* name : {"a", "b"}) {
        Part part;
        part.name = name;
        part.channels.push_back(Channel::make(name, ChannelType::Uint, image.data.pixel_count()));
        image.parts.push_back(std::move(part));
    }
    image.parts[1].compression = Compression::Rle;
    for (const auto& [asked, first, second] :
         {std::tuple{Compression::Zip, Imf::ZIP_COMPRESSION, Imf::RLE_COMPRESSION},
          {Compression::Piz, Imf::PIZ_COMPRESSION, Imf::RLE_COMPRESSION},
          {Compression::None, Imf::NO_COMPRESSION, Imf::NO_COMPRESSION}}) {
        ASSERT_TRUE(write_exr(path, image, asked).has_value());
        const Imf::MultiPartInputFile file(path.c_str());
        EXPECT_EQ(file.header(0).compression(), first);
        EXPECT_EQ(file.header(1).compression(), second);
        EXPECT_TRUE(read_exr(path).has_value());
    }
}

TEST(BadExr, NoCompressionMakesPixelsOfNothing) {
    const std::string path = temporary("promises.exr");
    for (const Imf::Compression compression : compressions) {
        make_exr(path, {{"rgba", {0, 0, 40, 30}, {"R", "G", "B"}, {}, {}, compression}});
        // As many chunks, but wide ones
        set_windows(path, {0, 0, 30000000, 30});
        const auto reader = ExrReader::open(path);
        ASSERT_FALSE(reader.has_value()) << compression;
        EXPECT_EQ(reader.error().code, "io-open");
        EXPECT_NE(reader.error().message.find("cannot hold 30000000×30 pixels of part 1"),
                  std::string::npos)
            << reader.error().message;
    }
}

TEST(BadExr, PartsShareTheBytesOfTheirFile) {
    // Each of forty could be, all of them cannot
    const std::string path = temporary("sum.exr");
    std::vector<MadePart> parts;
    for (int i = 0; i < 40; ++i)
        parts.push_back(
            {"part" + std::to_string(i), {0, 0, 40, 30}, {"R" + std::to_string(i)}, {}, {}});
    make_exr(path, parts);
    const auto bytes = double(std::filesystem::file_size(path));
    set_windows(path, {0, 0, int(bytes * 1032 / (2 * 30) / 2.5), 30});
    const auto reader = ExrReader::open(path);
    ASSERT_FALSE(reader.has_value());
    EXPECT_NE(reader.error().message.find("of part 3"), std::string::npos)
        << reader.error().message;
}

TEST(BadExr, AttributesEndWithTheFileAndWithTheirType) {
    const std::string path = temporary("attribute.exr");
    Image image;
    image.data = image.display = {0, 0, 2, 1};
    image.parts.push_back({"rgba", {Channel::make("R", ChannelType::Float, 2)}, {}});
    image.attributes = {{"comment", "long"}};
    for (const bool has_second_part : {false, true}) {
        if (has_second_part)
            image.parts.push_back({"more", {Channel::make("Z", ChannelType::Float, 2)}, {}});
        ASSERT_TRUE(write_exr(path, image).has_value());
        const std::string bytes = *read_file(path);
        const auto expect_refusal = [&](const std::string& name, const std::string& type,
                                        uint32_t more) {
            lengthen(path, bytes, name, type, more);
            for (const Error& error :
                 {read_exr(path).error(), layers::read_deep_file(path).error()}) {
                EXPECT_EQ(error.code, "io-open") << name;
                EXPECT_NE(error.message.find("its headers are damaged"), std::string::npos)
                    << error.message;
            }
        };
        lengthen(path, bytes, "comment", "string", 0);
        EXPECT_TRUE(read_exr(path).has_value());
        for (const uint32_t more : {uint32_t(bytes.size()), 0x34000000u, 0xfffffff0u})
            expect_refusal("comment", "string", more);
        // OpenEXR reads on where a number or a list of channels ends, whatever size it is said to
        // have
        for (const uint32_t more : {1u, 4u, 0xffffffffu}) {
            expect_refusal("pixelAspectRatio", "float", more);
            expect_refusal("channels", "chlist", more);
        }
    }
}

TEST(BadExr, HeaderStringsOfDeepJsonAreRefused) {
    const std::string path = temporary("deep_json.exr");
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    for (const char* name :
         {"velatura/sums", "velatura/split", "velatura/settings", "velatura/layers"}) {
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

/// A manifest costs names, not the image: its reader does not parse what is nested deeply.
TEST(BadExr, ManifestsOfDeepJsonAreToldWithoutTheirNames) {
    const std::string path = temporary("deep_manifest.exr");
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    Image image;
    image.data = image.display = {0, 0, 2, 1};
    image.parts.push_back({"", {Channel::make("R", ChannelType::Float, 2)}, {}});
    image.attributes["cryptomatte/1234567/name"] = std::string("CryptoObject");
    image.attributes["cryptomatte/1234567/manifest"] = "{\"rock\": " + deep + "}";
    ASSERT_TRUE(write_exr(path, image).has_value());
    const auto read = read_exr(path);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    const auto mattes = layers::cryptomattes_of(*read);
    ASSERT_EQ(mattes.size(), 1u);
    EXPECT_TRUE(mattes[0].names.empty());
    EXPECT_EQ(mattes[0].fault, "it cannot be read");
}

}  // namespace velatura::image
