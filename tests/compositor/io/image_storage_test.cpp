// SPDX-License-Identifier: Apache-2.0
// How images of a mix are stored, read back by oiiotool and OpenEXR.
#include "compositor/io/image_storage.h"

#include "base/atomic_file.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix_job.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace velatura::compositor {
namespace {

using enum Control::Kind;

std::string path_of(const std::string& name) {
    return film::temporary_file("storage_" + name);
}

Outcome comp(const std::string& arguments) {
    return run(std::string(VELATURA_BIN_DIR) + "/velatura-comp " + arguments);
}

#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
bool has_oiiotool() {
    return std::system("oiiotool --version >/dev/null 2>&1") == 0;
}

/// Channels of a file as oiiotool has them, alpha not multiplied in, one after the other.
std::vector<double> stored_values(const std::string& file, const std::string& channels) {
    const std::string plain = path_of("plain.exr");
    const Outcome made =
        run(fmt::format("oiiotool --iconfig oiio:UnassociatedAlpha 1 '{}' --ch {} -d float -o '{}'",
                        file, channels, plain));
    EXPECT_EQ(made.code, 0) << made.output;
    const auto image = image::read_exr(plain);
    EXPECT_TRUE(image.has_value());
    std::vector<double> values;
    if (!image) return values;
    for (const char c : channels) {
        const image::Channel* const channel = image->find(std::string(1, c));
        if (!channel) continue;
        for (size_t i = 0; i < channel->size(); ++i) values.push_back(double(channel->value(i)));
    }
    return values;
}

/// RGB is pixel · step, times an alpha of a half; the last pixel is light without alpha.
std::string soft_ramp(int width, float step) {
    image::Image image;
    image.data = image.display = {0, 0, width, 1};
    image.parts.emplace_back();
    for (const char* name : {"R", "G", "B", "A"}) {
        image::Channel channel =
            image::Channel::make(name, image::ChannelType::Float, size_t(width));
        auto& values = std::get<std::vector<float>>(channel.data);
        for (int i = 0; i < width; ++i)
            values[size_t(i)] = *name == 'A' ? 0.5f : 0.5f * step * float(i);
        if (*name == 'A') values.back() = 0;
        image.parts[0].channels.push_back(std::move(channel));
    }
    const std::string path = path_of("ramp.exr");
    EXPECT_TRUE(image::write_exr(path, image).has_value());
    return path;
}

Look raw() {
    Look look;
    look.display = "sRGB";
    look.view = "Raw";
    return look;
}

TEST(ImageStorage, AlphaDividesWhatIsShown) {
    if (!has_oiiotool()) GTEST_SKIP() << "no oiiotool on this machine";
    ASSERT_EQ(unsetenv("OCIO"), 0);
    const std::string ramp = soft_ramp(11, 0.1f);
    for (const char* name : {"soft.png", "soft.tif"}) {
        mix::MixJob job;
        job.look = raw();
        job.storage.has_alpha = true;
        const auto warnings = mix::mix_one(job, {ramp}, path_of(name), {}, 1);
        ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
        EXPECT_TRUE(std::any_of(warnings->begin(), warnings->end(), [](const std::string& w) {
            return w.find("1 pixels have light and no alpha") != std::string::npos;
        })) << name;
        const std::vector<double> red = stored_values(path_of(name), "R"),
                                  alpha = stored_values(path_of(name), "A");
        ASSERT_EQ(red.size(), 11u) << name;
        ASSERT_EQ(alpha.size(), 11u) << name;
        for (size_t i = 0; i < 10; ++i) {
            // The Raw view changes nothing: light over alpha is pixel / 10
            EXPECT_NEAR(255 * red[i], 25.5 * double(i), 0.501) << name << i;
            EXPECT_NEAR(255 * alpha[i], 128, 1e-3) << name << i;
        }
        EXPECT_EQ(red[10], 0);
        EXPECT_EQ(alpha[10], 0);
    }
}

TEST(ImageStorage, EveryFormatStoresItsBits) {
    if (!has_oiiotool()) GTEST_SKIP() << "no oiiotool on this machine";
    ASSERT_EQ(unsetenv("OCIO"), 0);
    constexpr int width = 256;
    const std::string ramp = soft_ramp(width, 1.8f / 255);

    struct Row {
        const char* name;
        int bits;
    };

    for (const Row& row : {Row{"a.png", 8}, Row{"b.png", 16}, Row{"c.tif", 8}, Row{"d.tiff", 16},
                           Row{"e.dpx", 8}, Row{"f.dpx", 10}, Row{"g.dpx", 12}, Row{"h.dpx", 16}}) {
        mix::MixJob job;
        job.look = raw();
        job.storage.display.bits = row.bits;
        const auto warnings = mix::mix_one(job, {ramp}, path_of(row.name), {}, 1);
        ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
        const std::vector<double> green = stored_values(path_of(row.name), "G");
        ASSERT_EQ(green.size(), size_t(width)) << row.name;
        double furthest = 0;
        // 0.9/255 a pixel, as the ramp has an alpha of a half: steps that 8 bits do not have
        for (size_t i = 0; i < green.size(); ++i)
            furthest = std::max(furthest, std::abs(green[i] - 0.9 * double(i) / 255));
        // Half a step, and of 10 and 12 bits, which OpenImageIO reads as 16, one of theirs
        const double max = 0.5 / double((1 << row.bits) - 1) + 1.01 / 65535;
        EXPECT_LE(furthest, max) << row.name;
    }
}

/// The mean over pixels is that of the light, where whole steps would be all one of two.
TEST(ImageStorage, DitherKeepsTheMean) {
    constexpr int size = 256;
    constexpr double steps = 100.3;
    const std::vector<float> rgb(size_t(3 * size * size), float(steps / 255));
    const std::string path = path_of("dither.png");
    ASSERT_TRUE(image::write_display_image(path, {size, size, 3, rgb}, {0, true}).has_value());
    const auto read = image::read_rgb_image(path, image::SourceColorSpace::Raw);
    ASSERT_TRUE(read.has_value());
    double mean = 0;
    for (const float v : read->pixels) {
        const double step = std::round(double(v) * 255);
        ASSERT_TRUE(step == 100 || step == 101);
        mean += step / double(rgb.size());
    }
    // Of so many numbers that are 1 with a chance of 0.3
    const double deviation = std::sqrt(0.3 * 0.7 / double(rgb.size()));
    fmt::print("mean {:.5f} of {}, detectable {:.2g}\n", mean, steps, 3.86 * deviation);
    EXPECT_NEAR(mean, steps, 2.58 * deviation);
    const auto without = image::write_display_image(path, {size, size, 3, rgb}, {0, false});
    ASSERT_TRUE(without.has_value());
    const auto plain = image::read_rgb_image(path, image::SourceColorSpace::Raw);
    ASSERT_TRUE(plain.has_value());
    for (const float v : plain->pixels) ASSERT_EQ(std::round(double(v) * 255), 100);
}

#endif

TEST(ImageStorage, HalvesAreTheMixRoundedAndSoIsItsHeader) {
    const std::string layers = path_of("layers.exr");
    ASSERT_TRUE(image::write_exr(layers, made_layers()).has_value());
    mix::MixJob job;
    job.look = look_of({{Gain, "key=1.7"}});
    ASSERT_TRUE(mix::mix_one(job, {layers}, path_of("float.exr"), {}, 1).has_value());
    job.storage.type = image::ChannelType::Half;
    ASSERT_TRUE(mix::mix_one(job, {layers}, path_of("half.exr"), {}, 1).has_value());
    const auto a = image::read_exr(path_of("float.exr")), b = image::read_exr(path_of("half.exr"));
    ASSERT_TRUE(a.has_value() && b.has_value());
    for (const char* name : {"R", "G", "B"}) {
        ASSERT_EQ(b->find(name)->type(), image::ChannelType::Half);
        for (size_t i = 0; i < a->data.pixel_count(); ++i)
            ASSERT_EQ(b->find(name)->value(i), float(Imath::half(a->find(name)->value(i)))) << i;
    }
    const Outcome verified = comp(fmt::format("verify '{}'", path_of("half.exr")));
    EXPECT_EQ(verified.code, 0) << verified.output;

    // Beyond 65,504 there is no half
    job.look = look_of({{Gain, "all=1e6"}});
    const auto warnings = mix::mix_one(job, {layers}, path_of("half.exr"), {}, 1);
    ASSERT_TRUE(warnings.has_value());
    ASSERT_FALSE(warnings->empty());
    EXPECT_NE((*warnings)[0].find("exceed the range of half floats"), std::string::npos)
        << (*warnings)[0];
    job.is_strict = true;
    EXPECT_EQ(mix::mix_one(job, {layers}, path_of("half.exr"), {}, 1).error().code, "not-finite");
}

TEST(ImageStorage, ExrFilesArePackedAsAsked) {
    const std::string layers = path_of("layers.exr");
    ASSERT_TRUE(image::write_exr(layers, made_layers()).has_value());
    const std::pair<image::Compression, Imf::Compression> rows[] = {
        {image::Compression::None, Imf::NO_COMPRESSION},
        {image::Compression::Rle, Imf::RLE_COMPRESSION},
        {image::Compression::Zips, Imf::ZIPS_COMPRESSION},
        {image::Compression::Zip, Imf::ZIP_COMPRESSION},
        {image::Compression::Piz, Imf::PIZ_COMPRESSION}};
    std::string digest;
    for (const auto& [asked, found] : rows) {
        mix::MixJob job;
        job.storage.compression = asked;
        ASSERT_TRUE(mix::mix_one(job, {layers}, path_of("packed.exr"), {}, 1).has_value());
        const Imf::MultiPartInputFile file(path_of("packed.exr").c_str());
        EXPECT_EQ(file.header(0).compression(), found);
        const auto read = image::read_exr(path_of("packed.exr"));
        ASSERT_TRUE(read.has_value());
        const std::string values(static_cast<const char*>(read->find("G")->bytes()),
                                 read->find("G")->byte_count());
        if (digest.empty()) digest = values;
        EXPECT_EQ(values, digest);
    }
}

#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
TEST(ImageStorage, WhatAFormatDoesNotHaveIsRefused) {
    const std::string layers = path_of("layers.exr");
    ASSERT_TRUE(image::write_exr(layers, made_layers()).has_value());

    struct Row {
        const char* output;
        const char* options;
        int code;
        const char* message;
    };

    for (const Row& row :
         {Row{"a.exr", "--depth half", 0, ""},
          Row{"a.exr", "--depth float --compression piz", 0, ""},
          Row{"a.png", "--depth 16 --alpha --dither", 0, ""}, Row{"a.DPX", "", 0, ""},
          Row{"a.jpg", "--dither", 0, ""},
          Row{"x.exr", "--depth 16", 2, "--depth 16 is not for .exr: it has half, float"},
          Row{"x.exr", "--alpha", 2, "--alpha is not for .exr"},
          Row{"x.exr", "--dither", 2, "--dither is not for .exr"},
          Row{"x.exr", "--depth half --with-layers", 2, "remove --depth half"},
          Row{"x.exr", "--compression dwaa", 2, "dwaa"},
          Row{"x.png", "--depth half", 2, "it has 8, 16 bits"},
          Row{"x.png", "--depth 10", 2, "it has 8, 16 bits"},
          Row{"x.jpg", "--depth 16", 2, "it has 8 bits"},
          Row{"x.jpg", "--alpha", 2, ".png, .tif and .exr store it"},
          Row{"x.dpx", "--alpha", 2, ".png, .tif and .exr store it"},
          Row{"x.tif", "--compression zip", 2, "it has only one compression"},
          Row{"x.gif", "", 2, ".exr, .png, .jpg, .jpeg, .tif, .tiff or .dpx"}}) {
        const std::string output = path_of(row.output);
        const Outcome done = comp(fmt::format("mix '{}' -o '{}' {}", layers, output, row.options));
        EXPECT_EQ(done.code, row.code) << row.output << " " << row.options << done.output;
        EXPECT_NE(done.output.find(row.message), std::string::npos) << done.output;
        EXPECT_EQ(read_file(output).has_value(), row.code == 0) << output;
    }
}

#endif

}  // namespace
}  // namespace velatura::compositor
