// SPDX-License-Identifier: Apache-2.0
#include "hard_case.h"
#include "shading/texture_cache.h"
#include "stored_zip.h"
#include "texture_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <vector>

namespace velatura::shading {
namespace {

using scene::SourceColorSpace;
using scene::Wrap;
using testing::ImageFolder;

scene::Texture texture(const std::string& file,
                       SourceColorSpace space = SourceColorSpace::Raw,
                       Wrap wrap = Wrap::Repeat) {
    scene::Texture t;
    t.file = t.authored = file;
    t.colors.curve = space;
    t.wrap_s = t.wrap_t = wrap;
    t.fallback = {0.25f, 0.5f, 0.75f, 1.0f};
    return t;
}

class Textures : public ::testing::Test {
  protected:
    TextureCache::Handle open(const scene::Texture& t) {
        return cache.open(t, SourceLoc{}, "/Looks/Tex", diagnostics);
    }

    TexelRgba at(TextureCache::Handle h, double s, double t) {
        return cache.lookup(h, Vec2(float(s), float(t)), Vec2(0.0f));
    }

    ImageFolder folder;
    Diagnostics diagnostics;
    TextureCache cache{size_t(64) << 20};
};

/// Without the curve, in other primaries, then scale and bias: 0.5² = 0.25; the primaries hand red
/// to green; 2 · 0.25 + 1.
TEST_F(Textures, ColorsOfOtherSpacesAreDecodedBeforeScaleAndBias) {
    scene::Texture t =
        texture(folder.write("space.exr", 1, 1, 3, OIIO::TypeFloat, {0.5f, 0.0f, 0.0f}));
    t.colors.decoding.exponent = 2;
    t.colors.decoding.to_working = {0, 0, 0, 1, 0, 0, 0, 0, 0};
    t.scale = {2, 2, 2, 2};
    t.bias = {1, 1, 1, 0};
    const TexelRgba texel = at(open(t), 0.5, 0.5);
    EXPECT_FLOAT_EQ(texel[0], 1.0f);
    EXPECT_NEAR(texel[1], 1.5f, 1e-4f);
    EXPECT_FLOAT_EQ(texel[2], 1.0f);
    EXPECT_FLOAT_EQ(texel[3], 2.0f) << "alpha has no curve";
}

/// 8-bit codes 0 … 255 spread over an image.
std::vector<float> codes(size_t count) {
    std::vector<float> v(count);
    for (size_t i = 0; i < count; ++i) v[i] = float((i * 37 + 11) % 256) / 255.0f;
    return v;
}

TEST_F(Textures, TexelsAreExactAtTheirCentersFromTheLowerLeft) {
    constexpr int w = 8, h = 4;
    const std::vector<float> pixels = codes(w * h * 3);
    const auto handle = open(texture(folder.write("rgb.png", w, h, 3, OIIO::TypeUInt8, pixels)));
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const TexelRgba c = at(handle, (x + 0.5) / w, (y + 0.5) / h);
            const size_t row = size_t(h - 1 - y);  // row 0 of the file is at the top
            for (size_t k = 0; k < 3; ++k) {
                ASSERT_NEAR(double(c[k]), double(pixels[(row * w + size_t(x)) * 3 + k]), 1e-6);
            }
            ASSERT_EQ(c[3], 1.0f);
        }
    }
    EXPECT_EQ(diagnostics.error_count(), 0u);
}

TEST_F(Textures, BilinearBetweenCenters) {
    const auto handle =
        open(texture(folder.write("two.exr", 2, 1, 3, OIIO::TypeFloat, {0, 0, 0, 8, 4, 2})));
    const TexelRgba c = at(handle, 0.375, 0.5);
    EXPECT_NEAR(double(c[0]), 2.0, 1e-5);
    EXPECT_NEAR(double(c[2]), 0.5, 1e-5);
}

TEST_F(Textures, ChannelsWidenToRgba) {
    const auto one = open(texture(folder.write("one.png", 1, 1, 1, OIIO::TypeUInt8, {0.2f})));
    const auto two = open(texture(folder.write("two.tif", 1, 1, 2, OIIO::TypeUInt8, {0.2f, 0.6f})));
    const auto four =
        open(texture(folder.write("four.png", 1, 1, 4, OIIO::TypeUInt8, {0.2f, 0.4f, 0.6f, 0.4f})));
    const TexelRgba a = at(one, 0.5, 0.5), b = at(two, 0.5, 0.5), d = at(four, 0.5, 0.5);
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(double(a[k]), 0.2, 1e-6);
        EXPECT_NEAR(double(b[k]), 0.2, 1e-6);
        // Straight alpha: colors are not multiplied
        EXPECT_NEAR(double(d[k]), 0.2 * double(k + 1), 1e-6);
    }
    EXPECT_EQ(a[3], 1.0f);
    EXPECT_NEAR(double(b[3]), 0.6, 1e-6);
    EXPECT_NEAR(double(d[3]), 0.4, 1e-6);
}

TEST_F(Textures, SrgbIsDecodedPerTexelAndAlphaIsNot) {
    std::vector<float> pixels(256 * 4);
    for (size_t i = 0; i < 256; ++i) {
        for (size_t k = 0; k < 4; ++k) pixels[i * 4 + k] = float(i) / 255.0f;
    }
    const std::string path = folder.write("ramp.png", 256, 1, 4, OIIO::TypeUInt8, pixels);
    const auto srgb = open(texture(path, SourceColorSpace::Srgb));
    const auto automatic = open(texture(path, SourceColorSpace::Auto));
    const auto raw = open(texture(path, SourceColorSpace::Raw));
    for (int i = 0; i < 256; ++i) {
        const double code = i / 255.0;
        const double linear =
            code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
        const TexelRgba c = at(srgb, (i + 0.5) / 256, 0.5);
        ASSERT_NEAR(double(c[1]), linear, linear * 0x1p-11 + 1e-7);
        ASSERT_NEAR(double(c[3]), code, 0x1p-11);
        ASSERT_EQ(at(automatic, (i + 0.5) / 256, 0.5)[1], c[1]);
        // The same file in the other decoding, from the same cache
        ASSERT_NEAR(double(at(raw, (i + 0.5) / 256, 0.5)[1]), code, 1e-6);
    }
}

TEST_F(Textures, FilteringHappensAfterDecoding) {
    // Black and white in turn: the mean of light is 1/2, that of codes would decode to 0.21
    std::vector<float> pixels(16 * 16 * 3);
    for (size_t i = 0; i < 256; ++i) {
        for (size_t k = 0; k < 3; ++k) pixels[i * 3 + k] = (i + i / 16) % 2 == 0 ? 1.0f : 0.0f;
    }
    const auto handle = open(texture(folder.write("check.png", 16, 16, 3, OIIO::TypeUInt8, pixels),
                                     SourceColorSpace::Srgb));
    EXPECT_NEAR(double(cache.lookup(handle, Vec2(0.3f, 0.6f), Vec2(1.0f, 1.0f))[0]), 0.5, 0.01);
    EXPECT_NEAR(double(cache.lookup(handle, Vec2(0.3f, 0.6f), Vec2(100.0f))[0]), 0.5, 0.01);
}

TEST_F(Textures, AutoDecodesOnlyEightBitColor) {
    const auto gray = open(
        texture(folder.write("g.png", 1, 1, 1, OIIO::TypeUInt8, {0.5f}), SourceColorSpace::Auto));
    const auto wide =
        open(texture(folder.write("w.png", 1, 1, 3, OIIO::TypeUInt16, {0.5f, 0.5f, 0.5f}),
                     SourceColorSpace::Auto));
    const auto light =
        open(texture(folder.write("f.exr", 1, 1, 3, OIIO::TypeHalf, {0.5f, 0.5f, 0.5f}),
                     SourceColorSpace::Auto));
    const auto color =
        open(texture(folder.write("c.png", 1, 1, 3, OIIO::TypeUInt8, {0.5f, 0.5f, 0.5f}),
                     SourceColorSpace::Auto));
    EXPECT_NEAR(double(at(gray, 0.5, 0.5)[0]), 128 / 255.0, 1e-6);
    EXPECT_NEAR(double(at(wide, 0.5, 0.5)[0]), 0.5, 1e-4);
    EXPECT_EQ(at(light, 0.5, 0.5)[0], 0.5f);
    EXPECT_NEAR(double(at(color, 0.5, 0.5)[0]), 0.2158605, 2e-4);
}

TEST_F(Textures, WrapModes) {
    const std::string path = folder.write("ramp.exr", 4, 4, 3, OIIO::TypeFloat, [] {
        std::vector<float> v;
        for (int i = 0; i < 16; ++i) v.insert(v.end(), {float(i % 4 + 1), float(4 - i / 4), 1});
        return v;
    }());
    // s runs over texels 1 2 3 4 from the left, t from the bottom
    const auto value = [&](Wrap wrap, double s, double t) {
        const TexelRgba c = at(open(texture(path, SourceColorSpace::Raw, wrap)), s, t);
        return Vec2(c[0], c[1]);
    };
    const double first = 0.125, last = 0.875;
    EXPECT_EQ(value(Wrap::Repeat, 1 + first, -1 + last), Vec2(1, 4));
    EXPECT_EQ(value(Wrap::Mirror, 1 + first, -first), Vec2(4, 1));
    EXPECT_EQ(value(Wrap::Clamp, 3.0, -2.0), Vec2(4, 1));
    EXPECT_EQ(value(Wrap::Black, 1 + first, 0.5), Vec2(0, 0));
    EXPECT_EQ(value(Wrap::Black, first, first), Vec2(1, 1));
    // No metadata in the file: black, not repeat
    EXPECT_EQ(value(Wrap::UseMetadata, -1 + first, first), Vec2(0, 0));
    const auto outside = open(texture(path, SourceColorSpace::Raw, Wrap::Black));
    EXPECT_EQ(at(outside, 2.5, 2.5)[3], 0.0f);
}

// wrapS and wrapT of the specification, else OpenImageIO's wrapmodes; what the scene says wins
TEST_F(Textures, WrapModesOfTheFile) {
    const std::vector<float> pixels = {1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4};
    const auto row = [&](const std::string& name, const std::map<std::string, std::string>& said,
                         Wrap wrap, double s) {
        const std::string path = folder.write(name, 4, 1, 3, OIIO::TypeFloat, pixels, said);
        return at(open(texture(path, SourceColorSpace::Raw, wrap)), s, 0.5)[0];
    };
    const auto both = [](const char* mode) {
        return std::map<std::string, std::string>{{"wrapS", mode}, {"wrapT", mode}};
    };
    const Wrap use = Wrap::UseMetadata;
    EXPECT_EQ(row("repeat.exr", both("repeat"), use, 1.125), 1.0f);
    EXPECT_EQ(row("mirror.exr", both("mirror"), use, 1.125), 4.0f);
    EXPECT_EQ(row("clamp.exr", both("clamp"), use, 3.0), 4.0f);
    EXPECT_EQ(row("black.exr", both("black"), use, 1.125), 0.0f);
    EXPECT_EQ(row("typing.exr", both("sideways"), use, 1.125), 0.0f);
    EXPECT_EQ(row("oiio.exr", {{"wrapmodes", "periodic,clamp"}}, use, 1.125), 1.0f);
    EXPECT_EQ(row("both.exr", {{"wrapmodes", "periodic,clamp"}, {"wrapS", "mirror"}}, use, 1.125),
              4.0f);
    EXPECT_EQ(row("scene.exr", both("repeat"), Wrap::Clamp, 1.125), 4.0f);
}

TEST_F(Textures, ScaleAndBias) {
    scene::Texture t = texture(folder.write("n.png", 1, 1, 3, OIIO::TypeUInt8, {0.0f, 0.4f, 1.0f}));
    t.scale = {2, 2, 2, 1};
    t.bias = {-1, -1, -1, 0};
    const TexelRgba c = at(open(t), 0.5, 0.5);
    EXPECT_NEAR(double(c[0]), -1.0, 1e-6);
    EXPECT_NEAR(double(c[1]), -0.2, 1e-6);
    EXPECT_NEAR(double(c[2]), 1.0, 1e-6);
    EXPECT_EQ(c[3], 1.0f);
}

using H52Textures = Textures;

TEST_F(H52Textures, NanTexelsReadAsZero) {
    int bad = 0;
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                inf = std::numeric_limits<float>::infinity();
    const auto handle =
        open(texture(folder.write("nan.exr", 2, 1, 3, OIIO::TypeFloat, {nan, inf, 1, 1, 1, 1})));
    for (double s = 0; s <= 1; s += 0.125) {
        const TexelRgba c = at(handle, s, 0.5);
        for (const float v : c) bad += !std::isfinite(v);
    }
    hardcase::expect_within(
        {"lookups beside NaN and infinite texels that are not finite", double(bad), 0, 0, "none"});
    const TexelRgba c = at(handle, 0.25, 0.5);
    EXPECT_EQ(c[0], 0.0f);
    EXPECT_EQ(c[1], 0.0f);
    EXPECT_EQ(c[2], 1.0f);
    const TexelRgba lost = at(handle, double(nan), 0.5);
    EXPECT_EQ(lost[0], 0.25f);
}

TEST_F(Textures, BrokenFilesCostOneErrorAndGiveTheFallback) {
    const auto missing = open(texture(folder.file("nowhere.png")));
    const auto text = open(texture(folder.write_text("text.png", "this is no picture")));
    // Without a name there is nothing to report here
    const auto empty = open(texture(""));
    EXPECT_EQ(diagnostics.error_count(), 2u);
    EXPECT_EQ(cache.failed_count(), 2u);
    for (const auto handle : {missing, text, empty}) {
        EXPECT_FALSE(cache.is_valid(handle));
        for (int i = 0; i < 3; ++i)
            EXPECT_EQ(at(handle, 0.1 * i, 0.5), (TexelRgba{0.25f, 0.5f, 0.75f, 1.0f}));
    }
    EXPECT_EQ(diagnostics.error_count(), 2u);
    const Diagnostic d = diagnostics.all()[0];
    EXPECT_EQ(d.prim_path, "/Looks/Tex");
    EXPECT_NE(d.message.find("nowhere.png"), std::string::npos);
}

/// Of a known kind under the name of another; nothing else is tried on what is neither.
TEST_F(Textures, ImagesUnderAWrongNameAreReadByWhatTheyBeginWith) {
    const std::string path = folder.write("real.png", 1, 1, 3, OIIO::TypeUInt8, {1, 0, 1});
    const std::string misnamed = folder.file("misnamed.jpg");
    std::filesystem::rename(path, misnamed);
    EXPECT_EQ(at(open(texture(misnamed)), 0.5, 0.5), (TexelRgba{1, 0, 1, 1}));
    EXPECT_EQ(diagnostics.error_count(), 0u);
    const std::string bitmap = folder.write("real.bmp", 1, 1, 3, OIIO::TypeUInt8, {1, 0, 1});
    std::filesystem::rename(bitmap, folder.file("misnamed.png"));
    open(texture(folder.file("misnamed.png")));
    EXPECT_EQ(diagnostics.error_count(), 1u);
}

/// OpenEXR would take the memory before it finds that the file ends.
TEST_F(Textures, AttributesLongerThanTheirFileAreRefused) {
    const std::string path =
        folder.write("long.exr", 2, 1, 3, OIIO::TypeFloat, {0, 0, 0, 8, 4, 2}, {{"note", "text"}});
    std::ifstream in(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const size_t at = bytes.find(std::string("note\0string", 11));
    ASSERT_NE(at, std::string::npos);
    bytes[at + 15] = '\x6f';
    std::ofstream(path, std::ios::binary) << bytes;
    open(texture(path));
    ASSERT_EQ(diagnostics.error_count(), 1u);
    EXPECT_NE(diagnostics.all()[0].message.find("an attribute is longer than the file"),
              std::string::npos);
}

/// Tiles that fill such a window are more than OpenImageIO counts: it ended the process.
TEST_F(Textures, WindowsOfTooManyPixelsAreRefused) {
    const std::string path = folder.file("window.exr");
    const auto out = OIIO::ImageOutput::create(path);
    OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeFloat);
    spec.full_width = 83886081;
    spec.full_height = 167247873;
    ASSERT_TRUE(out->open(path, spec));
    ASSERT_TRUE(out->write_image(OIIO::TypeFloat, std::vector<float>(6, 0.5f).data()));
    ASSERT_TRUE(out->close());
    EXPECT_EQ(at(open(texture(path)), 0.5, 0.5), (TexelRgba{0.25f, 0.5f, 0.75f, 1.0f}));
    EXPECT_EQ(diagnostics.error_count(), 1u);
}

TEST_F(Textures, TruncatedFileCostsOneErrorWhenItIsRead) {
    // Noise does not compress: a quarter of the file is a quarter of the rows
    std::vector<float> noise(256 * 256 * 3);
    uint32_t state = 1;
    for (float& v : noise) v = float((state = state * 1664525u + 1013904223u) >> 24) / 255.0f;
    const std::string path = folder.write("cut.png", 256, 256, 3, OIIO::TypeUInt8, noise);
    ASSERT_GT(std::filesystem::file_size(path), 150000u);
    std::filesystem::resize_file(path, 40000);
    const auto handle = open(texture(path));
    for (double t = 0; t < 1; t += 0.1) {
        for (const float v : at(handle, 0.5, t)) ASSERT_TRUE(std::isfinite(v));
    }
    EXPECT_EQ(diagnostics.error_count(), 1u);
}

TEST_F(H52Textures, UdimTilesAndGaps) {
    folder.write("skin.1001.png", 2, 2, 3, OIIO::TypeUInt8, std::vector<float>(12, 0.2f));
    folder.write("skin.1012.png", 2, 2, 3, OIIO::TypeUInt8, std::vector<float>(12, 0.8f));
    const auto handle = open(texture(folder.file("skin.<UDIM>.png")));
    EXPECT_EQ(diagnostics.error_count(), 0u);
    EXPECT_NEAR(double(at(handle, 0.4, 0.9)[0]), 0.2, 1e-6);
    EXPECT_NEAR(double(at(handle, 1.5, 1.01)[0]), 0.8, 1e-6);  // column 1, row 1: 1001 + 1 + 10
    hardcase::expect_within({"a tile that is not there, less its fallback",
                             std::abs(double(at(handle, 2.5, 0.5)[1]) - 0.5), 0, 0,
                             "the fallback that the material names"});
    EXPECT_EQ(at(handle, -0.5, 0.5)[1], 0.5f);
    EXPECT_EQ(at(handle, 3e9, 0.5)[1], 0.5f);
    open(texture(folder.file("none.<UDIM>.png")));
    EXPECT_EQ(diagnostics.error_count(), 1u);
}

TEST_F(Textures, ImagesInPackagesAreReadFromMemory) {
    const std::vector<float> pixels = codes(4 * 4 * 3);
    const auto bytes_of = [&](const std::string& name, OIIO::TypeDesc format) {
        std::ifstream in(folder.write(name, 4, 4, 3, format, pixels), std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    const std::string png = bytes_of("a.png", OIIO::TypeUInt8);
    const std::string exr = bytes_of("a.exr", OIIO::TypeFloat);
    const std::string inner = velatura::testing::stored_zip({{"deep.png", png}});
    const std::string file = folder.write_text(
        "p.usdz", velatura::testing::stored_zip({{"root.usda", "#usda 1.0"},
                                                 {"tex/a.png", png},
                                                 {"tex/a.exr", exr},
                                                 {"wrong.jpg", png},
                                                 {"inner.usdz", inner},
                                                 {"cut.png", png.substr(0, png.size() / 2)},
                                                 {"a.ico", "data"},
                                                 {"u.1001.png", png},
                                                 {"u.1012.png", png}}));
    const auto plain = open(texture(folder.file("a.png")));
    for (const char* member : {"tex/a.png", "tex/a.exr", "wrong.jpg", "inner.usdz[deep.png]"}) {
        const auto packed = open(texture(file + '[' + member + ']'));
        for (double s = 0.125; s < 1.0; s += 0.25) {
            const TexelRgba a = at(plain, s, 0.375), b = at(packed, s, 0.375);
            for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(a[k], b[k], 1e-6f) << member;
        }
    }
    EXPECT_EQ(diagnostics.error_count(), 0u);
    const auto udim = open(texture(file + "[u.<UDIM>.png]"));
    EXPECT_EQ(at(udim, 0.375, 0.375), at(plain, 0.375, 0.375));
    EXPECT_EQ(at(udim, 1.375, 1.375), at(plain, 0.375, 0.375));
    EXPECT_EQ(at(udim, 2.375, 0.375), texture("").fallback);
    // What cannot be had costs one error that names the asset
    for (const char* member : {"none.png", "a.ico", "cut.png"}) {
        const size_t before = diagnostics.error_count();
        const auto broken = open(texture(file + '[' + member + ']'));
        at(broken, 0.5, 0.1);
        EXPECT_EQ(diagnostics.error_count(), before + 1) << member;
        EXPECT_NE(diagnostics.all().back().message.find(member), std::string::npos);
    }
}

TEST_F(Textures, PackedImagesAreReadInAnyOrderOfTheirLines) {
    constexpr int size = 200;
    const std::vector<float> pixels = codes(size_t(size) * size * 3);
    std::vector<velatura::testing::ZipEntry> entries;
    const std::vector<std::string> names = {"a.png", "a.jpg", "a.TGA", "a.tif", "a.exr", "a.hdr"};
    for (const std::string& name : names) {
        folder.write(name, size, size, 3, OIIO::TypeUInt8, pixels);
        std::ifstream in(folder.file(name), std::ios::binary);
        entries.push_back({name, std::string(std::istreambuf_iterator<char>(in), {})});
    }
    const std::string file =
        folder.write_text("p.usdz", velatura::testing::stored_zip(std::move(entries)));
    for (const std::string& name : names) {
        const auto plain = open(texture(folder.file(name)));
        const auto packed = open(texture(file + '[' + name + ']'));
        // From the last line of the file to the first: later tiles are read before earlier ones
        for (int y = 0; y < size; y += 7) {
            const double t = (y + 0.5) / size;
            EXPECT_EQ(at(packed, 0.4, t), at(plain, 0.4, t)) << name << " line " << y;
        }
    }
    EXPECT_EQ(diagnostics.error_count(), 0u);
}

TEST_F(Textures, RefusesImagesTooWide) {
    // A PBM header alone tells the size
    const std::string path =
        folder.write_text("wide.pgm", "P5\n2000000 1\n255\n" + std::string(2000000, 'x'));
    const auto handle = open(texture(path));
    EXPECT_FALSE(cache.is_valid(handle));
    ASSERT_EQ(diagnostics.error_count(), 1u);
    EXPECT_NE(diagnostics.all()[0].message.find("2000000"), std::string::npos);
}

}  // namespace
}  // namespace velatura::shading
