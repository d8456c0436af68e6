// SPDX-License-Identifier: Apache-2.0
#include "layers/cryptomatte.h"

#include "hard_case.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace velatura::image {
namespace {

/// Four pixels: a rock, a rock before a tree, a leaf, nothing.
Image forest() {
    Image image;
    image.data = image.display = {0, 0, 4, 1};
    layers::Cryptomatte matte{"CryptoObject", {}};
    for (const char* name : {"/Set/Rock", "/Set/Tree", "/Set/Tree/Leaf", "/Set/Treehouse"})
        matte.names.push_back({name, layers::matte_id(name)});
    layers::describe_cryptomatte(matte, image.attributes);
    const auto id = [](const char* name) { return std::bit_cast<float>(layers::matte_id(name)); };
    Part part;
    const auto add = [&part](const char* name, std::vector<float> values) {
        Channel c;
        c.name = name;
        c.data = std::move(values);
        part.channels.push_back(std::move(c));
    };
    add("CryptoObject00.R", {id("/Set/Rock"), id("/Set/Rock"), id("/Set/Tree/Leaf"), 0});
    add("CryptoObject00.G", {1.0f, 0.75f, 0.5f, 0});
    add("CryptoObject00.B", {0, id("/Set/Tree"), 0, 0});
    add("CryptoObject00.A", {0, 0.25f, 0, 0});
    image.parts.push_back(std::move(part));
    return image;
}

Result<std::vector<float>> matte_of(const Image& image,
                                    const char* layer,
                                    const std::vector<std::string>& patterns) {
    const auto mattes = layers::cryptomattes_of(image);
    const auto found = layers::find_matte(mattes, layer);
    if (!found) return found.error();
    const auto ids = layers::matte_ids(**found, patterns);
    if (!ids) return ids.error();
    return layers::matte_coverage(image, (*found)->layer, *ids);
}

std::vector<float> matte(const Image& image, std::vector<std::string> patterns) {
    const auto result = matte_of(image, "object", patterns);
    EXPECT_TRUE(result.has_value()) << result.error().message;
    return result ? *result : std::vector<float>();
}

TEST(Cryptomatte, HashesAsMurmurHash3) {
    // Of the reference implementation; seeds and lengths of 0 to 4 past a whole word
    EXPECT_EQ(layers::murmur_hash_3(""), 0u);
    EXPECT_EQ(layers::murmur_hash_3("", 1), 0x514e28b7u);
    EXPECT_EQ(layers::murmur_hash_3("a", 0x9747b28c), 0x7fa09ea6u);
    EXPECT_EQ(layers::murmur_hash_3("aa", 0x9747b28c), 0x5d211726u);
    EXPECT_EQ(layers::murmur_hash_3("aaa", 0x9747b28c), 0x283e0130u);
    EXPECT_EQ(layers::murmur_hash_3("aaaa", 0x9747b28c), 0x5a97808au);
    EXPECT_EQ(layers::murmur_hash_3("Hello, world!", 0x9747b28c), 0x24884cbau);
    EXPECT_EQ(layers::murmur_hash_3("The quick brown fox jumps over the lazy dog", 0x9747b28c),
              0x2fa826cdu);
}

TEST(H53StableIds, AreThoseOfTheSpecificationsExample) {
    const int wrong = (layers::matte_id("bunny") != 0x13851a76u) +
                      (layers::matte_id("default") != 0x42c9679fu) +
                      (layers::matte_id("bunny_porcelain_mat") != 0xb24b26d4u);
    hardcase::expect_within({"ids of the specification's example that differ", double(wrong), 0, 0,
                             "Cryptomatte specification 1.2"});
    // Every id is a normal number
    for (int i = 0; i < 20000; ++i) {
        const uint32_t id = layers::matte_id("/World/thing_" + std::to_string(i));
        ASSERT_TRUE(std::isnormal(std::bit_cast<float>(id))) << i;
    }
}

TEST(Cryptomatte, NamesChooseThemselvesAndWhatLiesBelow) {
    const Image image = forest();
    EXPECT_EQ(matte(image, {"/Set/Rock"}), (std::vector<float>{1, 0.75f, 0, 0}));
    EXPECT_EQ(matte(image, {"/Set/Tree"}), (std::vector<float>{0, 0.25f, 0.5f, 0}));
    EXPECT_EQ(matte(image, {"/Set/Tree/*"}), (std::vector<float>{0, 0, 0.5f, 0}));
    EXPECT_EQ(matte(image, {"*Leaf", "/Set/R?ck"}), (std::vector<float>{1, 0.75f, 0.5f, 0}));
    EXPECT_EQ(matte(image, {"/Set", "*"}), (std::vector<float>{1, 1, 0.5f, 0}));
    EXPECT_EQ(matte(image, {"/Set/Treehouse"}), (std::vector<float>{0, 0, 0, 0}));
}

TEST(Cryptomatte, SaysWhatItDoesNotKnow) {
    const Image image = forest();
    const std::vector<std::string> wrong = {"/Set/Rokc"};
    const auto name = matte_of(image, "object", wrong);
    ASSERT_FALSE(name.has_value());
    EXPECT_EQ(name.error().code, "matte-name");
    EXPECT_NE(name.error().message.find("(did you mean '/Set/Rock'?)"), std::string::npos)
        << name.error().message;
    const std::vector<std::string> leaf = {"Treehuose"};
    EXPECT_NE(matte_of(image, "object", leaf).error().message.find("'*/Treehouse'"),
              std::string::npos)
        << matte_of(image, "object", leaf).error().message;
    const auto layer = matte_of(image, "material", wrong);
    ASSERT_FALSE(layer.has_value());
    EXPECT_EQ(layer.error().code, "matte-layer");
    EXPECT_NE(layer.error().message.find("CryptoObject"), std::string::npos);
}

TEST(Cryptomatte, ReadsFilesWithoutAManifestByHash) {
    Image image = forest();
    for (auto& [name, attribute] : image.attributes) {
        if (name.ends_with("/manifest")) attribute = std::string("{ broken");
    }
    EXPECT_EQ(matte(image, {"/Set/Rock"}), (std::vector<float>{1, 0.75f, 0, 0}));
    const std::vector<std::string> pattern = {"/Set/*"};
    EXPECT_FALSE(matte_of(image, "object", pattern).has_value());
    // Other renderers' channel names, strings on the part alone
    image.parts[0].attributes.swap(image.attributes);
    for (Channel& c : image.parts[0].channels) c.name.back() = char(std::tolower(c.name.back()));
    EXPECT_EQ(matte(image, {"/Set/Rock"}), (std::vector<float>{1, 0.75f, 0, 0}));
}

TEST(Cryptomatte, KeepsHostileNames) {
    layers::Cryptomatte written{"CryptoMaterial", {}};
    for (const char* name :
         {"", "/a \"b\" \\c", "/\xc3\xa4\xe6\x9c\xa8/\xf0\x9f\x8c\xb3", "/x\ny\t\x01", "{\"a\":1}"})
        written.names.push_back({name, layers::matte_id(name)});
    Image image;
    layers::describe_cryptomatte(written, image.attributes);
    const auto read = layers::cryptomattes_of(image);
    ASSERT_EQ(read.size(), 1u);
    EXPECT_EQ(read[0].layer, "CryptoMaterial");
    ASSERT_EQ(read[0].names.size(), written.names.size());
    for (const layers::MatteName& n : written.names)
        EXPECT_NE(std::find(read[0].names.begin(), read[0].names.end(), n), read[0].names.end())
            << n.name;
}

}  // namespace
}  // namespace velatura::image
