// SPDX-License-Identifier: Apache-2.0
// Command lines as people type them for usdrecord and husk, against those of Velatura.
#include "app/foreign_options.h"

#include "command.h"
#include "image/exr.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

std::vector<std::string> split(const std::string& line) {
    std::istringstream in(line);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

}  // namespace

TEST(ForeignOptions, AreReplacedByThoseOfTheSameMeaning) {
    const struct {
        const char *typed, *meant;
    } rows[] = {
        // usdrecord
        {"render --imageWidth 640 --camera /Cam s.usda o.exr",
         "render --image-width 640 --camera /Cam s.usda -o o.exr"},
        {"--imageWidth=640 -cam /Cam s.usda o.exr",
         "--image-width 640 --camera /Cam s.usda -o o.exr"},
        {"render -w 64 --frames 101:105x2,110 s.usda o.####.exr",
         "render --image-width 64 s.usda -o o.####.exr --frames 101-105x2,110"},
        {"render -d s.usda o.exr", "render --frames default s.usda -o o.exr"},
        {"render --colorCorrectionMode disabled --disableGpu --disableCameraLight s.usda o.exr",
         "render s.usda -o o.exr"},
        {"render -rs /S -rp /P --purposes proxy,guide --sessionLayer l.usda s.usda",
         "render --settings /S --pass /P --purpose proxy,guide --session l.usda s.usda"},
        // husk
        {"render -r 640 360 -c /Cam -o o.exr -p 32 -j 2 s.usd",
         "render --res 640 360 -c /Cam -o o.exr --spp 32 --threads 2 s.usd"},
        {"render -f 5 -n 3 s.usd", "render s.usd --frames 5-7x1"},
        {"render --frame 10 --frame-count 3 --frame-inc 2 s.usd", "render s.usd --frames 10-14x2"},
        {"render -n 2 s.usd", "render s.usd --frames 1-2x1"},
        {"render --make-output-path --snapshot 30 s.usd", "render --snapshot 30s s.usd"},
        // Ours
        {"render s.usda -f 1-10x2,15 --snapshot 10s -o o.exr",
         "render s.usda --snapshot 10s -o o.exr --frames 1-10x2,15"},
        {"render s.usda --res 320x180 --crop 0 0.5 0 1",
         "render s.usda --res 320x180 --crop 0 0.5 0 1"},
        {"render s.usda -f", "render s.usda -f"},
        {"study s.usda -n 3", "study s.usda -n 3"},
        {"", ""},
    };

    for (const auto& row : rows) {
        const Result<std::vector<std::string>> words = app::with_own_options(split(row.typed));
        ASSERT_TRUE(words.has_value()) << row.typed << ": " << words.error().message;
        EXPECT_EQ(*words, split(row.meant)) << row.typed;
    }
}

TEST(ForeignOptions, WithoutSuchAMeaningAreRefused) {
    const Workplace w;
    w.write("s.usda", small_scene());

    const struct {
        const char *typed, *why;
    } rows[] = {
        {"--renderer Storm", "--renderer: Velatura is the renderer"},
        {"-R Karma", "-R: Velatura is the renderer"},
        {"-r Storm", "as in husk it is the resolution: -r 640 360"},
        {"--complexity high", "--complexity: curved surfaces are diced by --dicing-rate"},
        {"--mask /World", "--mask: a prim is hidden by --set"},
        {"--colorCorrectionMode sRGB", "--colorCorrectionMode: the EXR is scene-linear"},
        {"-n 0", "--frame-count: expected a whole number from 1 to 1000000"},
        {"-n 2.5", "--frame-count: expected a whole number from 1 to 1000000"},
        {"-n nan", "--frame-count: expected a whole number from 1 to 1000000"},
        {"-n 1e300", "--frame-count: expected a whole number from 1 to 1000000"},
        {"-n 2 -f inf", "--frame-count: --frame with it is one number"},
        {"-f 1-3 -n 2", "--frame-count: --frame with it is one number"},
        {"-n 2 -i 0", "--frame-inc: expected a number above 0"},
    };

    for (const auto& row : rows) {
        const CommandResult r = w.velatura(fmt::format("render {} s.usda", row.typed));
        EXPECT_EQ(r.exit_code, 2) << row.typed;
        EXPECT_EQ(r.output.rfind("error: ", 0), 0u) << r.output;
        EXPECT_NE(r.output.find(row.why), std::string::npos) << row.typed << ": " << r.output;
        EXPECT_NE(r.output.find(" [usage]"), std::string::npos) << r.output;
    }
    EXPECT_FALSE(w.exists("s.exr"));
}

/// A camera of 24 × 16: 60 pixels are 40 lines high, as usdrecord reckons.
TEST(ForeignOptions, RenderTheSame) {
    const Workplace w;
    w.write("s.usda",
            "#usda 1.0\ndef Camera \"Wide\"\n{\n float horizontalAperture = 24\n float "
            "verticalAperture = 16\n double3 xformOp:translate = (0, 0, 5)\n uniform "
            "token[] xformOpOrder = [\"xformOp:translate\"]\n}\ndef Sphere \"S\" {\n double "
            "radius.timeSamples = { 1: 1, 3: 2 }\n}\n");
    const std::string quick = " --spp 2 --progress none -q ";
    const auto render = [&](const std::string& words) {
        const CommandResult r = w.velatura(words + quick);
        ASSERT_EQ(r.exit_code, 0) << words << ": " << r.output;
    };
    render("render --imageWidth 60 --camera /Wide --frames 1:3 s.usda a.####.exr");
    render("render s.usda -c /Wide --res 60 40 -f 1-3 -o b.####.exr");
    render("render -r 60 40 -c /Wide -f 1 -n 3 -o c.####.exr s.usda");
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string end = fmt::format(".{:04d}.exr", frame);
        EXPECT_EQ(w.hash("a" + end), w.hash("b" + end));
        EXPECT_EQ(w.hash("c" + end), w.hash("b" + end));
    }
    EXPECT_NE(w.hash("a.0001.exr"), w.hash("a.0003.exr"));
    // Without a camera the aperture is that of the schema, 20.955 × 15.2908
    w.write("n.usda", "#usda 1.0\ndef Sphere \"S\" {}\n");
    render("n.usda -w 100 -o n.exr");
    const auto image = image::read_exr(w.path("n.exr"));
    ASSERT_TRUE(image.has_value());
    EXPECT_EQ(image->data.width(), 100);
    EXPECT_EQ(image->data.height(), 73);
    // In place of --res
    EXPECT_EQ(w.velatura("render n.usda --image-width 20 --res 20 20").exit_code, 2);
}

}  // namespace velatura::test
