// SPDX-License-Identifier: Apache-2.0
// Cryptomattes of two files as one, against the arithmetic of `over`.
#include "compositor/io/join_mattes.h"

#include "film/cryptomatte_decoder.h"
#include "film/film_scene.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace velatura::compositor {
namespace {

using test::CryptomatteDecoder;

struct Ranked {
    uint32_t id;
    float coverage;
};

/// One row of pixels with two ranks, as renderers write it.
struct Row {
    std::string layer, channels;  ///< spelling of R, G, B and A
    std::vector<std::vector<Ranked>> pixels;
    std::vector<float> alpha;  ///< empty: no beauty
    std::string manifest;
    int x0 = 0;
};

image::Image image_of(const Row& row) {
    image::Image image;
    const int width = int(row.pixels.size());
    image.data = {row.x0, 0, row.x0 + width, 1};
    image.display = {0, 0, 8, 1};
    image.parts.resize(1);
    const auto add = [&](const std::string& name, const auto& value_at) {
        auto channel = image::Channel::make(name, image::ChannelType::Float, size_t(width));
        auto& values = std::get<std::vector<float>>(channel.data);
        for (size_t i = 0; i < values.size(); ++i) values[i] = value_at(i);
        image.parts[0].channels.push_back(std::move(channel));
    };
    if (!row.alpha.empty()) {
        for (const char* c : {"R", "G", "B"}) add(c, [](size_t) { return 0.5f; });
        add("A", [&](size_t i) { return row.alpha[i]; });
    }
    for (size_t rank = 0; rank < 2; ++rank) {
        const auto at = [&](size_t i) {
            return rank < row.pixels[i].size() ? row.pixels[i][rank] : Ranked{0, 0.0f};
        };
        add(row.layer + "00." + row.channels[2 * rank],
            [&](size_t i) { return std::bit_cast<float>(at(i).id); });
        add(row.layer + "00." + row.channels[2 * rank + 1],
            [&](size_t i) { return at(i).coverage; });
    }
    image.attributes["cryptomatte/abcdef0/name"] = row.layer;
    image.attributes["cryptomatte/abcdef0/manifest"] = row.manifest;
    return image;
}

MatteInput read(const Row& row, const std::string& name) {
    const std::string path = film::temporary_file("join_" + name + ".exr");
    EXPECT_TRUE(image::write_exr(path, image_of(row)));
    auto input = read_mattes(path);
    EXPECT_TRUE(input) << (input ? "" : input.error().message);
    return input ? std::move(*input) : MatteInput();
}

std::string hex(const std::string& name, uint32_t id) {
    char text[9];
    std::snprintf(text, sizeof text, "%08x", id);
    return "\"" + name + "\":\"" + text + "\"";
}

uint32_t id_of(const std::string& name) {
    return CryptomatteDecoder::id_of(name);
}

TEST(JoinMattes, OfTwoRenderersAreOneByOver) {
    // The front is Blender's: three pixels from the second on, one of them with smoke of no id
    const Row front{"View Layer.CryptoObject",
                    "rgba",
                    {{{id_of("hero"), 1.0f}}, {{id_of("hero"), 0.4f}}, {}},
                    {1.0f, 0.4f, 0.5f},
                    "{" + hex("hero", id_of("hero")) + "}",
                    1};
    const Row back{"CryptoObject",
                   "RGBA",
                   {{{id_of("/Wall"), 1.0f}},
                    {{id_of("/Wall"), 1.0f}},
                    {{id_of("/Wall"), 0.75f}, {id_of("hero"), 0.25f}},
                    {{id_of("/Wall"), 0.75f}, {id_of("/Box"), 0.25f}}},
                   {1.0f, 1.0f, 1.0f, 1.0f},
                   "{" + hex("/Wall", id_of("/Wall")) + "," + hex("hero", id_of("hero")) + "," +
                       hex("/Box", id_of("/Box")) + "}"};
    const std::vector<MatteInput> files = {read(front, "front"), read(back, "back")};
    const auto joined = join_mattes(files);
    ASSERT_TRUE(joined) << joined.error().message;
    EXPECT_TRUE(joined->notes.empty());
    EXPECT_EQ(joined->image.data, (image::Window{0, 0, 4, 1}));
    const CryptomatteDecoder mattes(joined->image, "View Layer.CryptoObject");
    const auto expect = [&](const char* name, const std::vector<float>& expected) {
        const std::vector<float> found = mattes.matte(name);
        for (size_t i = 0; i < expected.size(); ++i) EXPECT_FLOAT_EQ(found[i], expected[i]) << name;
    };
    expect("hero", {0.0f, 1.0f, 0.4f + 0.6f * 0.25f, 0.0f});
    expect("/Wall", {1.0f, 0.0f, 0.6f * 0.75f, 0.5f * 0.75f});
    expect("/Box", {0.0f, 0.0f, 0.0f, 0.125f});
    EXPECT_EQ(mattes.manifest.size(), 3u);
    // The greatest first
    const auto ranks = layers::matte_ranks(joined->image, "View Layer.CryptoObject");
    ASSERT_TRUE(ranks);
    EXPECT_EQ(ranks->size(), 4u);
    EXPECT_FLOAT_EQ((*(*ranks)[0].coverage)[2], 0.55f);
    EXPECT_FLOAT_EQ((*(*ranks)[1].coverage)[2], 0.45f);
}

TEST(JoinMattes, WithoutAlphaTheMattesHide) {
    const Row front{"CryptoObject", "RGBA", {{{id_of("a"), 0.25f}}}, {}, ""};
    const Row back{"CryptoObject", "RGBA", {{{id_of("b"), 1.0f}}}, {}, ""};
    const std::vector<MatteInput> files = {read(front, "bare_front"), read(back, "bare_back")};
    EXPECT_EQ(files[0].notes.size(), 2u) << "no alpha, no manifest";
    const auto joined = join_mattes(files);
    ASSERT_TRUE(joined);
    const CryptomatteDecoder mattes(joined->image, "CryptoObject");
    EXPECT_FLOAT_EQ(mattes.matte("a")[0], 0.25f);
    EXPECT_FLOAT_EQ(mattes.matte("b")[0], 0.75f);
}

TEST(JoinMattes, ReportIdsOfTwoNamesAndNamesOfTwoIds) {
    const Row front{"CryptoObject",
                    "RGBA",
                    {{{7u << 23, 0.5f}, {9u << 23, 0.1f}}},
                    {0.6f},
                    "{" + hex("one", 7u << 23) + "," + hex("shared", 9u << 23) + "}"};
    const Row back{"CryptoObject",
                   "RGBA",
                   {{{7u << 23, 0.5f}, {11u << 23, 0.5f}}},
                   {1.0f},
                   "{" + hex("other", 7u << 23) + "," + hex("shared", 11u << 23) + "}"};
    const std::vector<MatteInput> files = {read(front, "ids_front"), read(back, "ids_back")};
    const auto joined = join_mattes(files);
    ASSERT_TRUE(joined);
    ASSERT_EQ(joined->notes.size(), 2u);
    EXPECT_NE(joined->notes[0].find("\"one\""), std::string::npos) << joined->notes[0];
    EXPECT_NE(joined->notes[0].find("\"other\""), std::string::npos) << joined->notes[0];
    EXPECT_NE(joined->notes[1].find("\"shared\" has the ID 04800000"), std::string::npos)
        << joined->notes[1];
    const auto coverage = [&](uint32_t id) {
        const auto matte = layers::matte_coverage(joined->image, "CryptoObject", std::vector{id});
        return matte ? (*matte)[0] : -1.0f;
    };
    EXPECT_FLOAT_EQ(coverage(7u << 23), 0.5f + 0.4f * 0.5f);
    EXPECT_FLOAT_EQ(coverage(9u << 23), 0.1f + 0.4f * 0.5f);
    EXPECT_EQ(coverage(11u << 23), 0.0f);
    // "shared" keeps one ID, "one" and "other" stand for the same
    const auto mattes = layers::cryptomattes_of(joined->image);
    ASSERT_EQ(mattes.size(), 1u);
    EXPECT_EQ(mattes[0].names, (std::vector<layers::MatteName>{
                                   {"one", 7u << 23}, {"other", 7u << 23}, {"shared", 9u << 23}}));
}

}  // namespace
}  // namespace velatura::compositor
