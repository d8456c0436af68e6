// SPDX-License-Identifier: Apache-2.0
// Cryptomattes as others write them, against a decoder that shares nothing with ours.
#include "base/atomic_file.h"
#include "compositor/inspect/info.h"
#include "compositor/look/mattes.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix_job.h"
#include "compositor/test_stack.h"
#include "film/cryptomatte_decoder.h"
#include "image/exr.h"
#include "layers/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

const std::vector<std::string>& objects() {
    static const std::vector<std::string> names = {"floor",
                                                   "Ball, \"red\"",
                                                   "hero:box.001",
                                                   "gloss*",
                                                   "R\xc3\xb6"
                                                   "d",
                                                   "a\\b",
                                                   "what?",
                                                   ""};
    return names;
}

/// Each pixel shows an object and, below it, the next.
image::Image scene(const std::string& layer, const std::string& manifest) {
    image::Image image = made_foreign({{"", {"R", "G", "B", "key.R", "key.G", "key.B"}}});
    for (const char* c : {"R", "G", "B", "A"}) {
        image::Channel channel = image::Channel::make(layer + "00." + c, image::ChannelType::Float,
                                                      image.data.pixel_count());
        auto& values = std::get<std::vector<float>>(channel.data);
        for (size_t i = 0; i < values.size(); ++i) {
            const size_t object = i % 7;  // the last is nowhere
            values[i] =
                *c == 'R' ? std::bit_cast<float>(test::CryptomatteDecoder::id_of(objects()[object]))
                : *c == 'G' ? 0.75f
                : *c == 'B' ? std::bit_cast<float>(
                                  test::CryptomatteDecoder::id_of(objects()[(object + 1) % 7]))
                            : 0.25f;
        }
        image.parts[0].channels.push_back(std::move(channel));
    }
    image.attributes["cryptomatte/1234567/name"] = layer;
    image.attributes["cryptomatte/1234567/hash"] = std::string("MurmurHash3_32");
    image.attributes["cryptomatte/1234567/conversion"] = std::string("uint32_to_float32");
    if (!manifest.empty()) image.attributes["cryptomatte/1234567/manifest"] = manifest;
    return image;
}

/// As Blender writes it: names between quotes as they are.
std::string blender_manifest() {
    std::string text = "{";
    for (const std::string& name : objects()) {
        char hex[9];
        std::snprintf(hex, sizeof hex, "%08x", test::CryptomatteDecoder::id_of(name));
        text += (text.size() > 1 ? ",\"" : "\"") + name + "\":\"" + hex + "\"";
    }
    return text + "}";
}

float coverage_again(size_t object, size_t pixel) {
    float sum = 0;
    if (pixel % 7 == object) sum += 0.75f;
    if ((pixel % 7 + 1) % 7 == object) sum += 0.25f;
    return sum;
}

std::string path_of(const std::string& name) {
    return film::temporary_file("mattes_" + name);
}

LayerStack stack_of(const image::Image& image, const std::string& name = "scene.exr") {
    EXPECT_TRUE(image::write_exr(path_of(name), image).has_value());
    auto stack = LayerStack::load(path_of(name), ForeignFiles::Plain);
    EXPECT_TRUE(stack.has_value());
    return std::move(*stack);
}

TEST(ForeignMattes, NamesOfAnyCharactersOfAManifestThatIsNoJson) {
    const LayerStack stack = stack_of(scene("View Layer.CryptoObject", blender_manifest()));
    for (size_t object = 0; object < 7; ++object) {
        for (const std::string layer : {"View Layer.CryptoObject", "CryptoObject", "object"}) {
            const auto matte = load_matte(stack, nullptr, layer + ":" + objects()[object]);
            ASSERT_TRUE(matte.has_value()) << objects()[object] << ": " << matte.error().message;
            for (size_t i = 0; i < matte->values->size(); ++i)
                ASSERT_EQ((*matte->values)[i], coverage_again(object, i)) << objects()[object];
            ASSERT_EQ(matte->notes.size(), 1u);
            EXPECT_NE(matte->notes[0].find("it is not valid JSON; 8 names were read"),
                      std::string::npos)
                << matte->notes[0];
        }
    }
    // Two at once, the comma of one escaped
    const auto two = load_matte(stack, nullptr, "object:Ball\\, \"red\",floor");
    ASSERT_TRUE(two.has_value()) << two.error().message;
    for (size_t i = 0; i < two->values->size(); ++i)
        ASSERT_EQ((*two->values)[i], coverage_again(0, i) + coverage_again(1, i));
    // Patterns still are
    EXPECT_TRUE(load_matte(stack, nullptr, "object:hero*").has_value());
    EXPECT_EQ(load_matte(stack, nullptr, "object:her").error().code, "matte-name");
}

TEST(ForeignMattes, DamagedManifestsGiveWhatTheyHold) {
    const std::string whole = blender_manifest();
    const std::vector<std::pair<std::string, size_t>> damaged = {
        {whole.substr(0, whole.size() - 1), 8},         // no end
        {whole.substr(0, whole.size() / 2), 3},         // cut
        {whole.substr(0, whole.size() - 1) + ",}", 8},  // a comma too many
        {"{ broken", 0},
        {"[1]", 0},
        {std::string(100000, '['), 0},
        {std::string(100000, '"'), 0},
        {"", 0}};
    for (const auto& [text, min] : damaged) {
        const LayerStack stack = stack_of(scene("crypto_object", text));
        const auto mattes = layers::cryptomattes_of(stack.image(), stack.path());
        ASSERT_EQ(mattes.size(), 1u);
        EXPECT_GE(mattes[0].names.size(), min) << text.substr(0, 40);
        EXPECT_FALSE(mattes[0].fault.empty());
        const auto matte = load_matte(stack, nullptr, "object:floor");
        ASSERT_TRUE(matte.has_value()) << matte.error().message;
        for (size_t i = 0; i < matte->values->size(); ++i)
            ASSERT_EQ((*matte->values)[i], coverage_again(0, i));
    }
}

TEST(ForeignMattes, ManifestsBesideTheFileAreRead) {
    image::Image image = scene("CryptoAsset", "");
    image.attributes["cryptomatte/1234567/manif_file"] = std::string("mattes_sidecar.json");
    ASSERT_TRUE(write_file_atomically(path_of("sidecar.json"), blender_manifest()).has_value());
    const auto matte = load_matte(stack_of(image), nullptr, "CryptoAsset:what\\?,hero*");
    ASSERT_TRUE(matte.has_value()) << matte.error().message;
    for (size_t i = 0; i < matte->values->size(); ++i)
        ASSERT_EQ((*matte->values)[i], coverage_again(6, i) + coverage_again(2, i));
    for (const char* outside : {"/etc/passwd", "../x.json", "gone.json"}) {
        image.attributes["cryptomatte/1234567/manif_file"] = std::string(outside);
        const LayerStack stack = stack_of(image);
        const auto mattes = layers::cryptomattes_of(stack.image(), stack.path());
        EXPECT_TRUE(mattes[0].names.empty());
        EXPECT_NE(mattes[0].fault.find(outside), std::string::npos) << mattes[0].fault;
    }
}

TEST(ForeignMattes, AnEmptyMatteIsTold) {
    const std::string path = path_of("scene.exr");
    stack_of(scene("CryptoObject", ""));
    mix::MixJob job;
    job.look = look_of({{Gain, "key=2"}});
    job.look.controls[0].matte = "CryptoObject:nobody";
    const auto warnings = mix::mix_one(job, {path}, path_of("empty.exr"), {}, 1);
    ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
    ASSERT_EQ(warnings->size(), 2u);
    EXPECT_NE((*warnings)[0].find("there is none; names are matched by their hash"),
              std::string::npos)
        << (*warnings)[0];
    EXPECT_NE((*warnings)[1].find("no pixel of CryptoObject shows \"nobody\""), std::string::npos)
        << (*warnings)[1];
}

TEST(ForeignMattes, HalfIdsAreRefusedForWhatTheyAreAndLossIsTold) {
    image::Image image = scene("CryptoObject", blender_manifest());
    const std::string path = path_of("scene.exr");
    for (image::Channel& c : image.parts[0].channels) {
        if (c.name.starts_with("Crypto"))
            c.data = std::vector<Imath::half>(image.data.pixel_count(), Imath::half(1));
    }
    const auto half = load_matte(stack_of(image), nullptr, "CryptoObject:floor");
    ASSERT_FALSE(half.has_value());
    EXPECT_NE(half.error().message.find("is stored as half"), std::string::npos)
        << half.error().message;
    image = scene("CryptoObject", blender_manifest());
    auto parts = LayerStack::from_image(image, ForeignFiles::Plain)->image();
    parts.parts[0].is_lossy = true;
    const auto lossy = load_matte(*LayerStack::from_image(parts, ForeignFiles::Plain), nullptr,
                                  "CryptoObject:floor");
    ASSERT_TRUE(lossy.has_value());
    ASSERT_EQ(lossy->notes.size(), 2u);
    EXPECT_NE(lossy->notes[1].find("lossy compression"), std::string::npos);
}

TEST(ForeignMattes, InfoListsNamesAndFaults) {
    const std::string text =
        inspect::info_text(stack_of(scene("CryptoObject", blender_manifest())));
    for (const std::string& name : objects()) EXPECT_NE(text.find(name), std::string::npos) << name;
    EXPECT_NE(text.find("matte      CryptoObject 8 names"), std::string::npos) << text;
    EXPECT_NE(text.find("it is not valid JSON"), std::string::npos);
}

TEST(ForeignMattes, InfoListsIdsWithoutNames) {
    const image::Image image = scene("CryptoObject", "{}");
    const std::string text = inspect::mattes_info_text(image, "mattes.exr"),
                      in_json = inspect::mattes_info_json(image, "mattes.exr");
    for (size_t object = 0; object < 7; ++object) {
        char hex[9];
        std::snprintf(hex, sizeof hex, "%08x", test::CryptomatteDecoder::id_of(objects()[object]));
        EXPECT_NE(text.find(std::string(" %  ") + hex), std::string::npos) << text;
        EXPECT_NE(in_json.find(std::string("\"") + hex + "\": 0."), std::string::npos) << in_json;
    }
}

/// Shares of a beauty that is black, or that light and its negative cancel in, are no numbers.
TEST(Numbers, InfoHasNoSharesOfNothingAndCountsNan) {
    image::Image image = made_foreign({{"", {"R", "G", "B", "key.R", "key.G", "key.B"}}});
    for (image::Channel& c : image.parts[0].channels) {
        auto& values = std::get<std::vector<float>>(c.data);
        if (c.name.size() == 1) std::fill(values.begin(), values.end(), 1e-30f);
        if (c.name == "key.G") values[5] = NAN;
    }
    const std::string text = inspect::info_text(stack_of(image));
    EXPECT_NE(text.find("      – %"), std::string::npos) << text;
    EXPECT_NE(text.find("1 values of key are not finite"), std::string::npos) << text;
}

}  // namespace
}  // namespace velatura::compositor
