// SPDX-License-Identifier: Apache-2.0
#include "base/exr_headers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <sstream>
#include <string>

namespace velatura {

namespace {

constexpr int old_version = 301, new_version = 302;

std::string number(uint32_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += char(value >> (8 * i) & 0xff);
    return bytes;
}

std::string attribute(const std::string& name,
                      const std::string& type,
                      uint32_t size,
                      const std::string& value) {
    return name + '\0' + type + '\0' + number(size) + value;
}

/// Ref: OpenEXR, "File Layout": magic number, version with flags, header.
std::string file(const std::string& attributes, bool has_parts = false) {
    return std::string("\x76\x2f\x31\x01\x02", 5) + char(has_parts ? 0x10 : 0) +
           std::string(2, '\0') + attributes + '\0';
}

std::string channels(const std::string& name) {
    return name + std::string(1 + 16, '\0') + '\0';
}

/// In memory and from a stream alike.
bool is_sane(const std::string& bytes, int version = old_version) {
    std::istringstream stream(bytes);
    const std::string streamed = exr_header_error(stream, bytes.size(), version);
    EXPECT_EQ(exr_header_error(bytes, version), streamed);
    return streamed.empty();
}

}  // namespace

TEST(ExrHeaders, WhatIsWholeIsSane) {
    EXPECT_TRUE(is_sane(file("")));
    EXPECT_TRUE(is_sane(
        file(attribute("gain", "float", 4, "1234") + attribute("who", "string", 3, "you"))));
    EXPECT_TRUE(is_sane(file(attribute("channels", "chlist", 19, channels("R")))));
    EXPECT_TRUE(is_sane(file(
        attribute("gain", "float", 4, "1234") + '\0' + attribute("gain", "float", 4, "1234") + '\0',
        true)));
    EXPECT_TRUE(is_sane(file("") + "pixels of whatever length"));
}

TEST(ExrHeaders, OtherFilesAreNobodysBusiness) {
    EXPECT_TRUE(is_sane(""));
    EXPECT_TRUE(is_sane("\x76\x2f\x31"));
    EXPECT_TRUE(is_sane("no picture at all, but long enough"));
}

TEST(ExrHeaders, AttributesLieWithinTheFile) {
    EXPECT_FALSE(is_sane(file(attribute("who", "string", 1'800'000'000, "you"))));
    EXPECT_FALSE(is_sane(file(attribute("who", "string", 0xffffffff, "you"))));
    EXPECT_FALSE(is_sane(file(attribute("who", "string", 100, "you"))));
    const std::string whole = file(attribute("gain", "float", 4, "1234"));
    for (size_t size = 8; size < whole.size(); ++size)
        EXPECT_FALSE(is_sane(whole.substr(0, size))) << size;
}

TEST(ExrHeaders, PartsAreWalkedOneByOne) {
    const std::string good = attribute("gain", "float", 4, "1234"),
                      bad = attribute("who", "string", 100, "you");
    EXPECT_TRUE(is_sane(file(good + '\0' + good + '\0' + good + '\0', true)));
    EXPECT_FALSE(is_sane(file(good + '\0' + good + '\0' + bad + '\0', true)));
    EXPECT_FALSE(is_sane(file(good + '\0' + good, true))) << "no empty header ends them";
    EXPECT_TRUE(is_sane(file(good + '\0' + bad))) << "pixels follow the header of the only one";
}

/// OpenEXR would go on at another place than where the next attribute begins.
TEST(ExrHeaders, ValuesHaveTheSizeOfTheirType) {
    EXPECT_FALSE(is_sane(file(attribute("gain", "float", 8, "12345678"))));
    EXPECT_FALSE(is_sane(file(attribute("view", "m44f", 3, "123"))));
    EXPECT_FALSE(is_sane(file(attribute("curve", "floatvector", 7, "1234567"))));
    EXPECT_TRUE(is_sane(file(attribute("curve", "floatvector", 8, "12345678"))));
    EXPECT_FALSE(is_sane(file(attribute("channels", "chlist", 20, channels("R") + "x"))));
    EXPECT_FALSE(is_sane(file(attribute("channels", "chlist", 18, channels("R")))));
}

/// OpenEXR takes memory for the lines that are compressed together when it opens a file.
TEST(ExrHeaders, BlocksAreNotThousandsOfTimesTheFile) {
    const auto image = [](uint32_t last_x, char compression, uint32_t tile_side,
                          const std::string& type = "tiledimage") {
        std::string attributes =
            attribute("channels", "chlist", 19, channels("R")) +
            attribute("compression", "compression", 1, std::string(1, compression)) +
            attribute("dataWindow", "box2i", 16,
                      number(0) + number(0) + number(last_x) + number(0));
        if (tile_side > 0) {
            attributes +=
                attribute("tiles", "tiledesc", 9, number(tile_side) + number(tile_side) + '\0');
            attributes += attribute("type", "string", uint32_t(type.size()), type);
        }
        return file(attributes);
    };
    constexpr char none = 0, dwab = 9;
    constexpr uint32_t sixteen_million = 1u << 24;  // of 4 bytes: 64 MB
    EXPECT_TRUE(is_sane(image(sixteen_million - 1, none, 0)));
    EXPECT_FALSE(is_sane(image(sixteen_million, none, 0)));
    EXPECT_TRUE(is_sane(image(sixteen_million, none, 0) + std::string(8000, 'x')))
        << "64 MB of 8 kB";
    EXPECT_TRUE(is_sane(image((1u << 16) - 1, dwab, 0)));
    EXPECT_FALSE(is_sane(image(1u << 16, dwab, 0)));
    EXPECT_TRUE(is_sane(image(15, none, 4096)));
    EXPECT_FALSE(is_sane(image(15, none, 4097)));
    EXPECT_FALSE(is_sane(image(0x7fffffff, dwab, 0xffffffff)));
    EXPECT_FALSE(is_sane(image(15, none, 0x80000000)));
    EXPECT_FALSE(is_sane(image(15, none, 4097, "deeptile")));
    EXPECT_TRUE(is_sane(image(15, none, 4097, "scanlineimage"))) << "nobody asks for its tiles";
}

TEST(ExrHeaders, NamesForIdsAreReadByVersion) {
    const std::string ids = attribute("ids", "idmanifest", 4, "1234");
    EXPECT_TRUE(is_sane(file(ids + "more"), old_version));
    EXPECT_TRUE(is_sane(file(ids), new_version));
    EXPECT_FALSE(is_sane(file(ids), old_version));
}

}  // namespace velatura
