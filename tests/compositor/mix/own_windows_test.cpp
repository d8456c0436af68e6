// SPDX-License-Identifier: Apache-2.0
// Crops, overscan, parts over windows of their own, and pixels that are not square.
#include "base/atomic_file.h"
#include "compositor/exports/export.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_job.h"
#include "compositor/outcome.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;

std::string path_of(const std::string& name) {
    return film::temporary_file("windows_" + name);
}

bool has_oiiotool() {
    return std::system("oiiotool --version >/dev/null 2>&1") == 0;
}

/// A file of oiiotool: a full frame, a part over 40×25 pixels at 10,5 and one that reaches out.
std::string cropped_parts() {
    const std::string path = path_of("parts.exr");
    const Outcome made = run(fmt::format(
        "oiiotool --pattern fill:topleft=.1,.2,.3:bottomright=.9,.5,.7 64x40 3 -d float --attrib "
        "name rgba -pattern constant:color=.25,.5,.125 40x25+10+5 3 -fullsize 64x40+0+0 -d float "
        "--attrib name key -pattern constant:color=.5,.25,.125 10x10-4+35 3 -fullsize 64x40+0+0 "
        "-d float --attrib name fill --siappendall -o {}",
        path));
    EXPECT_EQ(made.code, 0) << made.output;
    return path;
}

TEST(OwnWindows, PartsArePlacedNotDropped) {
    if (!has_oiiotool()) GTEST_SKIP() << "no oiiotool on this machine";
    const std::string path = cropped_parts();
    const auto file = layers::StripReader::open(path);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->description().data, (image::Window{-4, 0, 64, 45}));
    EXPECT_TRUE(file->foreign_parts().empty());
    MixJob job;
    job.look = look_of({{Gain, "key=3"}, {Gain, "fill=2"}});
    const std::string mixed = path_of("mixed.exr"), right = path_of("right.exr");
    const auto warnings = mix_one(job, {path}, mixed, {}, 1);
    ASSERT_TRUE(warnings.has_value()) << warnings.error().message;
    EXPECT_TRUE(warnings->empty());
    // The same sum by oiiotool, which places by data windows
    const Outcome summed = run(fmt::format(
        "oiiotool {0} --subimage rgba {0} --subimage key --mulc 2 --add {0} --subimage fill --add "
        "-d float -o {1}",
        path, right));
    ASSERT_EQ(summed.code, 0) << summed.output;
    const auto a = image::read_exr(mixed), b = image::read_exr(right);
    ASSERT_TRUE(a.has_value() && b.has_value());
    ASSERT_EQ(a->data, b->data);
    EXPECT_EQ(a->display, b->display);
    for (const char* c : {"R", "G", "B"}) {
        for (size_t i = 0; i < a->data.pixel_count(); ++i)
            ASSERT_NEAR(a->find(c)->value(i), b->find(c)->value(i), 1e-6) << c << i;
    }
    // From memory, and strip by strip, are the same bits
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const image::Image whole = apply_mix(*stack, *plan_mix(*stack, job.look), job.look, false);
    EXPECT_EQ(whole.find("G")->data, a->find("G")->data);
}

/// The data window of the second part, moved.
void move_second_part(const std::string& path, int dx) {
    std::string bytes = *read_file(path);
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const size_t at = bytes.find(name, bytes.find(name) + 1);
    ASSERT_NE(at, std::string::npos);
    for (const size_t number : {0, 2}) {
        int32_t x = 0;
        std::memcpy(&x, bytes.data() + at + name.size() + 4 * number, 4);
        x += dx;
        std::memcpy(bytes.data() + at + name.size() + 4 * number, &x, 4);
    }
    ASSERT_TRUE(write_file_atomically(path, bytes).has_value());
}

TEST(OwnWindows, APartFarAwayIsLeftOutByName) {
    const std::string path = path_of("far.exr");
    for (const int distance : {100'000, 1'000'000'000}) {
        ASSERT_TRUE(image::write_exr(
                        path, made_foreign({{"beauty", {"R", "G", "B"}}, {"key", {"R", "G", "B"}}}))
                        .has_value());
        move_second_part(path, distance);
        const auto file = layers::StripReader::open(path);
        ASSERT_TRUE(file.has_value()) << file.error().message;
        EXPECT_EQ(file->foreign_parts(), (std::vector<std::string>{"key"}));
        EXPECT_EQ(file->description().data, (image::Window{0, 0, 37, 21}));
        MixJob job;
        const auto warnings = mix_one(job, {path}, path_of("near.exr"), {}, 1);
        ASSERT_TRUE(warnings.has_value());
        ASSERT_EQ(warnings->size(), 1u);
        EXPECT_NE((*warnings)[0].find("part key skipped: its data window is too far"),
                  std::string::npos);
        job.look = look_of({{Gain, "key=2"}});
        EXPECT_EQ(mix_one(job, {path}, path_of("near.exr"), {}, 1).error().code, "unknown-name");
    }
}

image::Image cropped() {
    image::Image image = made_foreign({{"", {"R", "G", "B", "A", "key.R", "key.G", "key.B"}}});
    image.data = {16, 14, 16 + 37, 14 + 21};
    image.display = {0, 0, 64, 36};
    image.pixel_aspect_ratio = 2.0f;
    return image;
}

TEST(OwnWindows, ExportsKeepPositionAndAspect) {
    const std::string path = path_of("crop.exr");
    ASSERT_TRUE(image::write_exr(path, cropped()).has_value());
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Gain, "key=3"}});
    const auto plan = plan_mix(*stack, look);
    const image::Image right = apply_mix(*stack, *plan, look, false);
    EXPECT_EQ(right.data, (image::Window{16, 14, 53, 35}));
    EXPECT_EQ(right.pixel_aspect_ratio, 2.0f);
    const auto recipe = exports::mix_recipe(*stack, *plan, look, path);
    ASSERT_TRUE(recipe.has_value());
    // Middle of 0 … 64 × 0 … 36: 32, 18; of the pixels: 34.5, 24.5; up is positive
    EXPECT_EQ(recipe->offset, (std::array<double, 2>{2.5, -6.5}));
    const std::string blender = exports::blender_script(*recipe);
    EXPECT_NE(blender.find("OFFSET = (2.5, -6.5)"), std::string::npos) << blender;
    EXPECT_NE(blender.find("WIDTH, HEIGHT, PIXEL_ASPECT = 64, 36, 2"), std::string::npos);
    if (!has_oiiotool()) GTEST_SKIP() << "no oiiotool on this machine";
    const std::string script = path_of("crop.sh"), result = path_of("crop_result.exr");
    ASSERT_TRUE(write_file_atomically(script, exports::oiio_script(*recipe)).has_value());
    ASSERT_EQ(run(fmt::format("sh {} {} {}", script, path, result)).code, 0);
    const auto rebuilt = image::read_exr(result);
    ASSERT_TRUE(rebuilt.has_value());
    EXPECT_EQ(rebuilt->data, right.data);
    EXPECT_EQ(rebuilt->display, right.display);
    EXPECT_EQ(rebuilt->pixel_aspect_ratio, 2.0f);
    EXPECT_EQ(rebuilt->find("G")->data, right.find("G")->data);
}

/// A crop whose middle is half a pixel off, a gain and one below 1, which the recipe subtracts.
TEST(OwnWindows, BlenderRebuildsTheMixInItsPlace) {
    if (std::system("blender -b --version >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "no Blender on this machine";
    image::Image image = cropped();
    for (const char* c : {"fill.R", "fill.G", "fill.B"}) {
        image::Channel channel = *image.find(std::string("key.") + c[5]);
        channel.name = c;
        image.parts[0].channels.push_back(std::move(channel));
    }
    const std::string path = path_of("blender.exr"), script = path_of("blender.py"),
                      result = path_of("blender_result.exr");
    ASSERT_TRUE(image::write_exr(path, image).has_value());
    const auto stack = LayerStack::load(path, ForeignFiles::Plain);
    ASSERT_TRUE(stack.has_value());
    const Look look = look_of({{Gain, "key=3"}, {Tint, "fill=.5,1,2"}});
    const auto plan = plan_mix(*stack, look);
    const image::Image right = apply_mix(*stack, *plan, look, false);
    ASSERT_TRUE(write_file_atomically(script, exports::blender_script(
                                                  *exports::mix_recipe(*stack, *plan, look, path)))
                    .has_value());
    const Outcome outcome =
        run(fmt::format("blender -b --factory-startup -P {} -- {} {}", script, path, result));
    const auto rebuilt = image::read_exr(result);
    ASSERT_TRUE(rebuilt.has_value()) << outcome.output;
    ASSERT_EQ(rebuilt->data, (image::Window{0, 0, 64, 36}));
    for (const char* c : {"R", "G", "B", "A"}) {
        for (int y = 0; y < 36; ++y) {
            for (int x = 0; x < 64; ++x) {
                const bool is_stored = right.data.contains(x, y);
                ASSERT_EQ(rebuilt->find(c)->value(rebuilt->data.index(x, y)),
                          is_stored ? right.find(c)->value(right.data.index(x, y)) : 0.0f)
                    << c << " " << x << "," << y;
            }
        }
    }
}

TEST(OwnWindows, ImagesSayHowWideTheirPixelsAre) {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    GTEST_SKIP() << "built without the plugin openimageio";
#endif
    const auto stack = LayerStack::from_image(cropped(), ForeignFiles::Plain);
    const image::Image mixed = apply_mix(*stack, *plan_mix(*stack, {}), {}, false);
    const std::string png = path_of("aspect.png");
    ASSERT_TRUE(write_display(png, mixed, {}).has_value());
    // pHYs: pixels per unit in x and y, big endian; a pixel twice as wide has half as many in x
    const std::string bytes = *read_file(png);
    const size_t at = bytes.find("pHYs");
    ASSERT_NE(at, std::string::npos);
    const auto number = [&](size_t i) {
        uint32_t v = 0;
        for (size_t k = 0; k < 4; ++k) v = v << 8 | uint8_t(bytes[at + 4 + 4 * i + k]);
        return v;
    };
    EXPECT_EQ(2 * number(0), number(1));
}

}  // namespace
}  // namespace velatura::compositor::mix
