// SPDX-License-Identifier: Apache-2.0
#include "image/exr.h"

#include "base/atomic_file.h"
#include "image/digest.h"
#include "temporary.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <set>

namespace velatura::image {
namespace {

Image sample_image(int parts) {
    Image image;
    image.data = {3, -2, 20, 15};
    image.display = {0, 0, 32, 16};
    image.pixel_aspect_ratio = 2.0f;
    image.attributes["text"] = std::string("{\"a\": \"ä\"}");
    image.attributes["number"] = 7;
    image.attributes["framesPerSecond"] = 24.0;
    image.attributes["chromaticities"] =
        Chromaticities{0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f};
    Matrix44 matrix{};
    for (size_t i = 0; i < matrix.size(); ++i) matrix[i] = float(i);
    image.attributes["worldToCamera"] = matrix;
    for (int p = 0; p < parts; ++p) {
        Part part;
        part.name = parts > 1 ? "part" + std::to_string(p) : "";
        const size_t n = image.data.pixel_count();
        Channel h = Channel::make("b" + std::to_string(p) + ".R", ChannelType::Half, n);
        Channel f = Channel::make("c" + std::to_string(p) + ".R", ChannelType::Float, n);
        Channel u = Channel::make("d" + std::to_string(p), ChannelType::Uint, n);
        for (size_t i = 0; i < n; ++i) {
            std::get<0>(h.data)[i] = Imath::half(float(i) * 0.37f + float(p));
            std::get<1>(f.data)[i] = float(i) * 1.7e-9f - float(p);
            std::get<2>(u.data)[i] = uint32_t(i * 2654435761u);
        }
        part.channels = {h, f, u};
        image.parts.push_back(part);
    }
    return image;
}

TEST(Exr, KeepsEveryBitAndAttribute) {
    for (const int parts : {1, 3}) {
        const Image image = sample_image(parts);
        const std::string path = temporary("round_trip.exr");
        ASSERT_TRUE(write_exr(path, image).has_value());
        const auto back = read_exr(path);
        ASSERT_TRUE(back.has_value()) << back.error().message;
        EXPECT_EQ(back->data, image.data);
        EXPECT_EQ(back->display, image.display);
        EXPECT_EQ(back->pixel_aspect_ratio, image.pixel_aspect_ratio);
        for (const auto& [name, attribute] : image.attributes) {
            ASSERT_EQ(back->attributes.count(name), 1u) << name;
            EXPECT_TRUE(back->attributes.at(name) == attribute) << name;
        }
        ASSERT_EQ(back->parts.size(), image.parts.size());
        for (size_t p = 0; p < image.parts.size(); ++p) {
            EXPECT_EQ(back->parts[p].name, image.parts[p].name);
            for (const Channel& c : image.parts[p].channels) {
                const Channel* other = back->parts[p].find(c.name);
                ASSERT_NE(other, nullptr);
                ASSERT_EQ(other->type(), c.type());
                EXPECT_EQ(std::memcmp(other->bytes(), c.bytes(), c.byte_count()), 0) << c.name;
            }
        }
        EXPECT_EQ(digest_of(*back), digest_of(image));
    }
}

TEST(Exr, NoCompressionLosesABit) {
    const Image image = sample_image(2);
    const std::string path = temporary("packed.exr");
    std::set<size_t> sizes;
    for (const Compression c : {Compression::None, Compression::Rle, Compression::Zips,
                                Compression::Zip, Compression::Piz}) {
        ASSERT_TRUE(write_exr(path, image, c).has_value());
        const auto back = read_exr(path);
        ASSERT_TRUE(back.has_value()) << back.error().message;
        EXPECT_EQ(digest_of(*back), digest_of(image)) << int(c);
        sizes.insert(size_t(std::filesystem::file_size(path)));
    }
    EXPECT_GE(sizes.size(), 3u) << "other ways of packing have other sizes";
}

TEST(Exr, SaysWhatIsWrongWithBadFiles) {
    EXPECT_EQ(read_exr(temporary("missing.exr")).error().code, "io-open");
    const std::string text = temporary("text.exr");
    ASSERT_TRUE(write_file_atomically(text, "this is not an image").has_value());
    EXPECT_EQ(read_exr(text).error().code, "io-open");
    const std::string whole = temporary("whole.exr"), cut = temporary("cut.exr");
    ASSERT_TRUE(write_exr(whole, sample_image(2)).has_value());
    const auto bytes = read_file(whole);
    ASSERT_TRUE(write_file_atomically(cut, bytes->substr(0, bytes->size() * 2 / 3)).has_value());
    EXPECT_FALSE(read_exr(cut).has_value());
    EXPECT_EQ(write_exr("/dev/null/a.exr", sample_image(1)).error().code, "io-write");
}

TEST(Exr, TakesNoRowsFromTilesOfAPartOfScanlines) {
    // A text of nine bytes, to be overwritten by an attribute `tiles` of the same size; OpenEXR
    // checks it in parts of tiles alone
    Image image = sample_image(1);
    image.attributes["padding"] = std::string("123456789");
    const std::string path = temporary("tiles.exr");
    ASSERT_TRUE(write_exr(path, image).has_value());
    std::string bytes = *read_file(path);
    const std::string text("padding\0string\0\x09\0\0\0", 19),
        tiles("tiles\0tiledesc\0\x09\0\0\0", 19);
    const size_t at = bytes.find(text);
    ASSERT_NE(at, std::string::npos);
    for (const uint32_t side : {0u, 1u, 0x80000000u, 0xffffffffu}) {
        bytes.replace(at, tiles.size(), tiles);
        std::memcpy(bytes.data() + at + tiles.size(), &side, 4);
        std::memcpy(bytes.data() + at + tiles.size() + 4, &side, 4);
        bytes[at + tiles.size() + 8] = 0;
        ASSERT_TRUE(write_file_atomically(path, bytes).has_value());
        const auto reader = ExrReader::open(path);
        ASSERT_TRUE(reader.has_value()) << reader.error().message;
        EXPECT_EQ(reader->rows_per_chunk(0), 16) << side;
        EXPECT_EQ(digest_of(*read_exr(path)), digest_of(image));
    }
}

TEST(Digest, IsSha256AndSeesOneBit) {
    Sha256 sha;
    sha.add("abc");
    // FIPS 180-2, appendix B.1
    EXPECT_EQ(sha.finish(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    Image image = sample_image(2);
    const std::string before = digest_of(image);
    std::get<1>(image.parts[1].channels[1].data)[5] *= -1.0f;
    EXPECT_NE(digest_of(image), before);
}

}  // namespace
}  // namespace velatura::image
