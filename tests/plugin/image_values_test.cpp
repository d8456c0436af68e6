// SPDX-License-Identifier: Apache-2.0
// Images and textures have the same values, to the last bit, whether their decoders run in
// decoder processes or in this one.
#include "base/hash.h"
#include "base/process/mapping_guard.h"
#include "image/image_library.h"
#include "plugin/registry.h"
#include "shading/texture_cache.h"
#include "shading/texture_source.h"
#include "stored_zip.h"
#include "texture_files.h"

#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

namespace velatura::shading {
namespace {

using scene::SourceColorSpace;
using scene::Wrap;
using testing::ImageFolder;

const int max_side = limits().image_side;

/// What the plugin of one folder brings.
struct Plugin {
    const TextureSourceFactory* textures = nullptr;
    const image::ImageLibrary* images = nullptr;

    explicit Plugin(const std::string& folder) {
        Diagnostics diagnostics;
        const plugin::Registry registry({{folder}}, diagnostics);
        const auto object = [&](const char* name, uint32_t version, const char* trigger) {
            const plugin::Manifest* manifest = registry.find(name, {"asset", trigger});
            return manifest ? plugin::open_interface(*manifest, name, version, diagnostics)
                            : nullptr;
        };
        textures = static_cast<const TextureSourceFactory*>(
            object(texture_interface, texture_interface_version, "texture"));
        images = static_cast<const image::ImageLibrary*>(
            object(image::image_interface, image::image_interface_version, "picture"));
        EXPECT_TRUE(textures && images) << folder << diagnostics.error_count();
    }
};

const Plugin& built() {
    static const Plugin& plugin = [] {
        // As programs do, before they open a plugin
        read_truncated_pages_as_zeros();
        static const Plugin opened(VELATURA_BUILT_PLUGINS);
        return std::ref(opened);
    }();
    return plugin;
}

constexpr DecodeLimits sandboxed = {.is_sandboxed = true}, in_process = {.is_sandboxed = false};

/// Bits of texels all over a texture, at all widths, and what went wrong.
std::string texels(const DecodeLimits& decoding,
                   const std::string& file,
                   SourceColorSpace space,
                   Wrap wrap) {
    const auto source = built().textures->make(size_t(64) << 20, decoding);
    const auto opened = (*source)->open(file, space, wrap, Wrap::Mirror, max_side);
    if (!opened) return opened.error().message;
    std::string bits;
    for (uint64_t i = 0; i < 3000; ++i) {
        const auto random = [i](uint64_t which) {
            return float(mix64(i * 4 + which) >> 40) * 0x1p-24f;
        };
        const Vec2 st(3 * random(0) - 1, 3 * random(1) - 1),
            extent(random(2) * random(2), random(3) * random(3) * random(3));
        TexelRgba texel = {};
        if (!(*opened)->lookup(st, i % 3 == 0 ? Vec2(0.0f) : extent, texel))
            return (*source)->lookup_error();
        bits.append(reinterpret_cast<const char*>(texel.data()), sizeof texel);
    }
    return bits;
}

/// Bits of all values of an image, and what it says of itself.
std::string values(const DecodeLimits& decoding, const std::string& file) {
    built().images->limit(decoding);
    const auto opened = built().images->open(file);
    if (!opened) return opened.error().message;
    const image::ImageInfo& facts = (*opened)->facts();
    const int channels = facts.channels >= 3 ? 3 : 1;
    std::vector<float> all(size_t(facts.width) * size_t(facts.height) * size_t(channels));
    const Result<void> read = (*opened)->read(channels, all);
    if (!read) return read.error().message;
    std::string bits(reinterpret_cast<const char*>(all.data()), all.size() * sizeof(float));
    return bits + facts.color_space + (facts.is_floating_point ? " floats " : " integers ") +
           std::to_string(facts.channels);
}

/// Returns: whether the file can be read at all.
bool expect_same(const std::string& file, size_t max_ways = 4) {
    const std::string here = values(in_process, file), there = values(sandboxed, file);
    EXPECT_TRUE(here == there) << file << ": " << there.substr(0, 200) << " instead of "
                               << here.substr(0, 200);
    bool is_read = false;
    const std::pair<SourceColorSpace, Wrap> ways[] = {{SourceColorSpace::Raw, Wrap::Black},
                                                      {SourceColorSpace::Srgb, Wrap::Clamp},
                                                      {SourceColorSpace::Auto, Wrap::Repeat},
                                                      {SourceColorSpace::Raw, Wrap::UseMetadata}};
    for (size_t i = 0; i < max_ways; ++i) {
        const auto [space, wrap] = ways[i];
        const std::string a = texels(in_process, file, space, wrap),
                          b = texels(sandboxed, file, space, wrap);
        EXPECT_TRUE(a == b) << file << ": " << b.substr(0, 200) << " instead of "
                            << a.substr(0, 200);
        is_read = a.size() > 10000;
    }
    return is_read;
}

class ImageValues : public ::testing::Test {
  protected:
    /// Values from 0 to 2 of which some are not finite, and codes where the format has no others.
    std::vector<float> pixels(int width, int height, int channels, bool has_any_value) const {
        std::vector<float> all(size_t(width * height * channels));
        for (size_t i = 0; i < all.size(); ++i) {
            const uint64_t dice = mix64(i + 1);
            all[i] = float(dice % 256) / 255.0f * (has_any_value ? 2 : 1);
            if (has_any_value && dice % 1009 == 0) all[i] = std::numeric_limits<float>::quiet_NaN();
        }
        return all;
    }

    std::string write(const std::string& name,
                      int channels,
                      OIIO::TypeDesc format,
                      int width = 150,
                      int height = 131,
                      const std::map<std::string, std::string>& attributes = {}) {
        return folder.write(name, width, height, channels, format,
                            pixels(width, height, channels, format.is_floating_point()),
                            attributes);
    }

    /// Tiled, or with another window, or with lines compressed together.
    std::string write_spec(const std::string& name, OIIO::ImageSpec spec) {
        const std::string path = folder.file(name);
        const auto out = OIIO::ImageOutput::create(path);
        EXPECT_TRUE(out && out->open(path, spec)) << path;
        EXPECT_TRUE(out->write_image(
            OIIO::TypeFloat, pixels(spec.width, spec.height, spec.nchannels, false).data()));
        EXPECT_TRUE(out->close());
        return path;
    }

    ImageFolder folder;
};

TEST_F(ImageValues, AreTheSameInEveryFormat) {
    const OIIO::TypeDesc byte = OIIO::TypeUInt8, word = OIIO::TypeUInt16, half = OIIO::TypeHalf,
                         single = OIIO::TypeFloat;
    std::vector<std::string> files;
    for (int channels = 1; channels <= 4; ++channels) {
        const std::string c = std::to_string(channels);
        files.push_back(write(c + ".png", channels, byte));
        files.push_back(write(c + "w.png", channels, word));
        files.push_back(write(c + ".tif", channels, byte));
        files.push_back(write(c + "w.tif", channels, word));
        files.push_back(write(c + "f.tif", channels, single));
        files.push_back(write(c + ".exr", channels, half));
        files.push_back(write(c + "f.exr", channels, single));
    }
    files.push_back(write("five.tif", 5, word));
    files.push_back(write("seven.exr", 7, half));
    files.push_back(write("p.jpg", 3, byte));
    files.push_back(write("g.jpg", 1, byte));
    files.push_back(write("l.hdr", 3, single));
    files.push_back(write("t.tga", 4, byte));
    files.push_back(write("b.bmp", 3, byte));
    files.push_back(write("s.sgi", 3, word));
    files.push_back(write("d.dpx", 3, word));
    files.push_back(write("n.ppm", 3, byte));
    files.push_back(
        write("w.exr", 3, half, 40, 30, {{"wrapS", "mirror"}, {"wrapmodes", "periodic,clamp"}}));
    for (const std::string& file : files) EXPECT_TRUE(expect_same(file)) << file;
}

TEST_F(ImageValues, AreTheSameInTilesWindowsAndLevels) {
    for (const char* kind : {"exr", "tif"}) {
        OIIO::ImageSpec tiled(150, 131, 4, OIIO::TypeHalf);
        if (std::string(kind) == "tif") tiled.set_format(OIIO::TypeUInt8);
        tiled.tile_width = 32;
        tiled.tile_height = 16;
        EXPECT_TRUE(expect_same(write_spec(std::string("tiled.") + kind, tiled)));
    }
    OIIO::ImageSpec window(150, 131, 3, OIIO::TypeHalf);
    window.x = 10;
    window.y = -7;
    window.full_width = 200;
    window.full_height = 100;
    EXPECT_TRUE(expect_same(write_spec("window.exr", window)));
    OIIO::ImageSpec strips(150, 131, 3, OIIO::TypeUInt8);
    strips.attribute("tiff:RowsPerStrip", 50);
    EXPECT_TRUE(expect_same(write_spec("strips.tif", strips)));
    for (const char* name : {"levels.tx", "levels.exr"}) {
        OIIO::ImageBuf image(write("source.tif", 3, OIIO::TypeUInt8));
        ASSERT_TRUE(OIIO::ImageBufAlgo::make_texture(OIIO::ImageBufAlgo::MakeTxTexture, image,
                                                     folder.file(name), OIIO::ImageSpec()));
        EXPECT_TRUE(expect_same(folder.file(name)));
    }
}

/// More than is asked for at once.
TEST_F(ImageValues, AreTheSameInLargeImages) {
    EXPECT_TRUE(expect_same(write("large.png", 3, OIIO::TypeUInt8, 3000, 1000), 1));
    EXPECT_TRUE(expect_same(write("large.exr", 4, OIIO::TypeHalf, 3000, 1000), 1));
    OIIO::ImageSpec one_strip(3000, 1000, 3, OIIO::TypeUInt8);
    one_strip.attribute("tiff:RowsPerStrip", 1000);
    EXPECT_TRUE(expect_same(write_spec("large.tif", one_strip), 1));
    OIIO::ImageSpec tiled(3000, 1000, 3, OIIO::TypeHalf);
    tiled.tile_width = tiled.tile_height = 512;
    EXPECT_TRUE(expect_same(write_spec("tiles.exr", tiled), 1));
}

TEST_F(ImageValues, AreTheSameInPackages) {
    std::vector<velatura::testing::ZipEntry> entries;
    const std::vector<std::string> names = {"a.png", "a.jpg", "a.exr", "a.hdr", "a.tif"};
    for (const std::string& name : names) {
        const bool is_float = name == "a.exr" || name == "a.hdr";
        std::ifstream in(write(name, 3, is_float ? OIIO::TypeFloat : OIIO::TypeUInt8),
                         std::ios::binary);
        entries.push_back({name, std::string(std::istreambuf_iterator<char>(in), {})});
    }
    const std::string package =
        folder.write_text("p.usdz", velatura::testing::stored_zip(std::move(entries)));
    for (const std::string& name : names)
        EXPECT_TRUE(expect_same(package + '[' + name + ']')) << name;
    EXPECT_FALSE(expect_same(package + "[b.png]"));
}

/// Files that are cut somewhere, with a wrong byte, or no images: the same values or the same
/// reason.
TEST_F(ImageValues, AreRefusedInTheSameWords) {
    for (const std::string& good :
         {write("c.png", 3, OIIO::TypeUInt8), write("c.jpg", 3, OIIO::TypeUInt8),
          write("c.exr", 3, OIIO::TypeHalf), write("c.tif", 3, OIIO::TypeUInt16),
          write("c.hdr", 3, OIIO::TypeFloat)}) {
        std::ifstream in(good, std::ios::binary);
        const std::string bytes(std::istreambuf_iterator<char>(in), {});
        const std::string end = good.substr(good.size() - 4);
        for (const size_t size :
             {size_t(0), size_t(3), size_t(20), bytes.size() / 2, bytes.size() - 5})
            (void)expect_same(
                folder.write_text("cut" + std::to_string(size) + end, bytes.substr(0, size)));
        for (const size_t at : {size_t(9), size_t(30), bytes.size() / 2}) {
            std::string wrong = bytes;
            wrong[at] = char(~wrong[at]);
            (void)expect_same(folder.write_text("wrong" + std::to_string(at) + end, wrong));
        }
    }
    EXPECT_FALSE(expect_same(folder.write_text("text.png", "this is no picture")));
    EXPECT_FALSE(expect_same(folder.file("nowhere.png")));
    EXPECT_FALSE(expect_same("/dev/zero"));
    EXPECT_FALSE(expect_same(
        folder.write_text("wide.pgm", "P5\n2000000 1\n255\n" + std::string(2000000, 'x'))));
}

/// What may take too much of this process's memory is decoded in a decoder process.
TEST_F(ImageValues, AreTheSameWhereMemoryIsShort) {
    OIIO::ImageSpec spec(200, 100, 4, OIIO::TypeHalf);
    spec.tile_width = spec.tile_height = 32;
    for (const std::string& file :
         {write("lines.png", 3, OIIO::TypeUInt16, 200, 100), write_spec("tiles.exr", spec)}) {
        const std::string expected = values(in_process, file);
        for (const size_t bytes : {size_t(0), size_t(32 * 32 * 4 * 2), size_t(1) << 20})
            EXPECT_TRUE(values({.is_sandboxed = false, .in_process_bytes = bytes}, file) ==
                        expected)
                << file << bytes;
    }
}

/// The package is mapped by the plugin, which the list of the program does not know.
TEST_F(ImageValues, OfAPackageThatIsTruncatedAreAnError) {
    std::ifstream in(write("a.tif", 4, OIIO::TypeFloat, 600, 300), std::ios::binary);
    const std::string package = folder.write_text(
        "cut.usdz", velatura::testing::stored_zip(
                        {{"a.tif", std::string(std::istreambuf_iterator<char>(in), {})}}));
    const auto source = built().textures->make(size_t(64) << 20, in_process);
    const auto opened = (*source)->open(package + "[a.tif]", SourceColorSpace::Raw, Wrap::Black,
                                        Wrap::Black, max_side);
    ASSERT_TRUE(opened) << opened.error().message;
    std::filesystem::resize_file(package, 8192);
    TexelRgba texel = {};
    EXPECT_FALSE((*opened)->lookup(Vec2(0.5f), Vec2(0.0f), texel));
    const std::string why = (*source)->lookup_error();
    EXPECT_TRUE(why.starts_with("the file was truncated while it was read")) << why;
}

}  // namespace
}  // namespace velatura::shading
