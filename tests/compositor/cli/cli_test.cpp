// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/outcome.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "hard_case.h"
#include "image/exr.h"
#include "image/formats.h"
#include "layers/layer_file.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <regex>

namespace velatura::compositor::cli {
namespace {

namespace fs = std::filesystem;

Outcome comp(const std::string& arguments) {
    return run(std::string(VELATURA_BIN_DIR) + "/velatura-comp " + arguments);
}

std::string file(const std::string& name) {
    return film::temporary_file("cli_" + name);
}

/// Below a heat map of this height: its colors from black over red and yellow to white, and
/// letters.
void expect_scale(const image::RgbImage& image, int map_height) {
    ASSERT_GE(image.width, 60);
    ASSERT_GT(image.height, map_height + 30);
    const auto pixel = [&](int x, int y) {
        const float* const p = &image.pixels[3 * (size_t(y) * size_t(image.width) + size_t(x))];
        return std::array<float, 3>{p[0], p[1], p[2]};
    };
    const int bar = map_height + 10, last = image.width - 7;
    EXPECT_EQ(pixel(6, bar), (std::array<float, 3>{0, 0, 0}));
    EXPECT_EQ(pixel(last, bar), (std::array<float, 3>{1, 1, 1}));
    EXPECT_EQ(pixel(image.width / 2, bar)[0], 1.0f);
    EXPECT_EQ(pixel(image.width / 2, bar)[2], 0.0f);
    size_t bright = 0;
    for (int y = bar + 10; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) bright += pixel(x, y)[1] > 0.5f;
    EXPECT_GT(bright, 100u) << "letters";
}

class Cli : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        film::LayerSet set = film::test_layer_set();
        set.matrix_layers = set.shadow_layers = set.halves = true;
        for (const auto& [name, first, end] :
             {std::tuple{"whole", 0, 8}, std::tuple{"left", 0, 4}, std::tuple{"right", 4, 8}}) {
            film::Film film({0, 0, 20, 17}, set);
            film::render(film, uint64_t(first), uint64_t(end));
            film::FileInfo info;
            info.store_sums = true;
            ASSERT_TRUE(film.write(file(std::string(name) + ".exr"), info).has_value());
        }
    }
};

TEST_F(Cli, ExportWebWritesAPageAndScriptsTakeNoneOfItsOptions) {
    const std::string page = file("page.html");
    const Outcome web = comp("export web " + file("whole.exr") + " --view Raw -o " + page);
    EXPECT_EQ(web.code, 0) << web.output;
    EXPECT_NE(web.output.find("at 20x17; colors by the numbers as they are"), std::string::npos)
        << web.output;
    EXPECT_NE(web.output.find("100.000 %"), std::string::npos) << web.output;
    const auto html = read_file(page);
    ASSERT_TRUE(html.has_value());
    EXPECT_TRUE(html->starts_with("<!doctype html>"));
    // A page is no text to print, holds its image, and has no mattes
    EXPECT_EQ(comp("export web " + file("whole.exr")).code, 2);
    EXPECT_EQ(comp("export web " + file("whole.exr") + " --file a.exr -o " + page).code, 2);
    EXPECT_EQ(comp("export web " + file("whole.exr") + " --gain moon=2 -o " + page).code, 2);
    for (const char* option : {"--max-size 3", "--layers light", "--display sRGB", "--view Raw"}) {
        const Outcome script = comp("export oiio " + file("whole.exr") + " " + option);
        EXPECT_EQ(script.code, 2) << option;
        EXPECT_NE(script.output.find("bad-output"), std::string::npos) << script.output;
    }
}

TEST_F(Cli, HelpAndUsage) {
    EXPECT_EQ(comp("--help").code, 0);
    const Outcome version = comp("--version");
    EXPECT_EQ(version.code, 0);
    EXPECT_TRUE(std::regex_match(version.output, std::regex("velatura-comp \\d+\\.\\d+\\.\\d+\n")))
        << version.output;
    EXPECT_EQ(comp("merge").code, 2);
    EXPECT_NE(comp("mix --help").output.find("--shadow"), std::string::npos);
    EXPECT_EQ(comp("").code, 2);
    EXPECT_EQ(comp("paint x").code, 2);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o " + file("x.exr") + " --gain key=loud").code,
              2);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o " + file("x.exr") + " --gain moon=1").code, 2);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o " + file("x.gif")).code, 2);
    EXPECT_FALSE(fs::exists(file("x.exr")));
}

TEST_F(Cli, BadFilesAreErrorsWithoutAPartialFile) {
    ASSERT_TRUE(write_file_atomically(file("text.exr"), "no image").has_value());
    for (const std::string command : {"info ", "verify "}) {
        EXPECT_EQ(comp(command + file("missing.exr")).code, 1);
        EXPECT_EQ(comp(command + file("text.exr")).code, 1);
    }
    // Cut within what a mix needs: the parts after it may be gone
    const auto whole = read_file(file("whole.exr"));
    ASSERT_TRUE(
        write_file_atomically(file("cut.exr"), whole->substr(0, whole->size() / 20)).has_value());
    for (const char* name : {"missing.exr", "text.exr", "cut.exr"}) {
        const Outcome run = comp("mix " + file(name) + " -o " + file("no.exr"));
        EXPECT_EQ(run.code, 1) << run.output;
        EXPECT_NE(run.output.find(name), std::string::npos) << run.output;
        EXPECT_FALSE(fs::exists(file("no.exr")));
    }
    const Outcome view = comp("mix " + file("whole.exr") + " -o " + file("y.png") + " --view ACSE");
    EXPECT_NE(view.output.find("did you mean 'ACES'?"), std::string::npos) << view.output;
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o /dev/null/a.exr").code, 1);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o /dev/null/a.png").code, 1);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o " + file("y.png") + " --view Filmic").code, 1);
    EXPECT_FALSE(fs::exists(file("y.png")));
}

TEST_F(Cli, VerifyPassesAndFailsWithFourAfterOneChange) {
    EXPECT_EQ(comp("verify " + file("whole.exr")).code, 0);
    int families = 0;
    // One channel of each kind; the film tests change every channel there is
    for (const char* name : {"R", "b1_key.G", "S_sky.B", "primId", "C_key_hB.G", "sums_end"}) {
        auto image = image::read_exr(file("whole.exr"));
        ASSERT_TRUE(image.has_value());
        for (image::Part& part : image->parts) {
            for (image::Channel& c : part.channels) {
                if (c.name != name) continue;
                static_cast<unsigned char*>(c.bytes())[0] ^= 1;
                ++families;
            }
        }
        ASSERT_TRUE(layers::write_image_file(file("changed.exr"), *image).has_value());
        const Outcome run = comp("verify " + file("changed.exr"));
        EXPECT_EQ(run.code, 4) << name << ": " << run.output;
        EXPECT_NE(run.output.find("verify-failed"), std::string::npos);
    }
    EXPECT_EQ(families, 6);
}

using H51Closure = Cli;

TEST_F(H51Closure, UnitMixHasNoDifferenceInTheBeauty) {
    ASSERT_EQ(comp("mix " + file("whole.exr") + " -o " + file("unit.exr") + " --gain all=1").code,
              0);
    EXPECT_EQ(comp("verify " + file("unit.exr")).code, 0);
    const Outcome diff = comp("diff --json " + file("unit.exr") + " " + file("whole.exr"));
    const auto json = nlohmann::json::parse(diff.output);
    bool has_beauty = false;
    for (const auto& layer : json["layers"]) {
        if (layer["name"] != "rgba") continue;
        has_beauty = true;
        hardcase::expect_within({"beauty of a mix of all layers, less that of the render",
                                 layer["max"].get<double>(), 0, 0, "the file that was rendered"});
        EXPECT_EQ(layer["only"], "");
    }
    EXPECT_TRUE(has_beauty);
    EXPECT_EQ(comp("diff -q " + file("whole.exr") + " " + file("whole.exr")).code, 0);
    EXPECT_EQ(comp("diff -q " + file("left.exr") + " " + file("whole.exr")).code, 4);
    EXPECT_EQ(comp("diff -q --threshold 1e30 " + file("left.exr") + " " + file("whole.exr")).code,
              0);
}

TEST_F(Cli, AnExrIsOneInCapitalsAsWell) {
    for (const char* name : {"x.EXR", "x.Exr"}) {
        const Outcome run =
            comp("mix " + file("whole.exr") + " -o " + file(name) + " --with-layers");
        EXPECT_EQ(run.code, 0) << run.output;
        EXPECT_EQ(comp("verify " + file(name)).code, 0);
    }
}

TEST_F(Cli, RepeatedOptionsPresetAndImage) {
    const std::string look =
        " --gain indirect=+1.5st --gain key=0.5 --tint fill=1,.9,.8 --mute env --shadow key=0.3";
    ASSERT_EQ(comp("mix " + file("whole.exr") + " -o " + file("a.exr") + look + " --save-preset " +
                   file("look.json"))
                  .code,
              0);
    ASSERT_EQ(
        comp("mix " + file("whole.exr") + " -o " + file("b.exr") + " --preset " + file("look.json"))
            .code,
        0);
    EXPECT_EQ(comp("diff -q " + file("a.exr") + " " + file("b.exr")).code, 0);
    ASSERT_EQ(comp("mix " + file("whole.exr") + " -o " + file("plain.exr")).code, 0);
    EXPECT_EQ(comp("diff -q " + file("a.exr") + " " + file("plain.exr")).code, 4);
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    GTEST_SKIP() << "built without the plugin openimageio";
#endif
    for (const char* name : {"c.png", "c.jpg"}) {
        const Outcome run =
            comp("mix " + file("whole.exr") + " -o " + file(name) + look + " --exposure -8");
        ASSERT_EQ(run.code, 0) << run.output;
        const auto image = image::read_rgb_image(file(name));
        ASSERT_TRUE(image.has_value());
        EXPECT_EQ(image->width, 20);
        EXPECT_EQ(image->height, 17);
    }
}

TEST_F(Cli, DiffSaysWhatTheEyeSees) {
    ASSERT_EQ(comp("mix " + file("whole.exr") + " -o " + file("lit.exr") + " --gain key=2").code,
              0);
    const std::string files = file("lit.exr") + " " + file("whole.exr");
    EXPECT_NE(comp("diff --flip " + files).output.find("HDR-FLIP"), std::string::npos);
    const auto json = nlohmann::json::parse(comp("diff --flip --json " + files).output);
    EXPECT_GT(json["flip"]["mean"].get<double>(), 0.0);
    EXPECT_LE(json["flip"]["max"].get<double>(), 1.0);
    EXPECT_EQ(comp("diff " + files + " -o " + file("flip.gif")).code, 2);
#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    EXPECT_EQ(comp("diff -q " + files + " -o " + file("flip.png")).code, 4);
    const auto image = image::read_rgb_image(file("flip.png"));
    ASSERT_TRUE(image.has_value());
    expect_scale(*image, 17);
#endif
}

TEST_F(Cli, ViewPutsAllLayersOnOneImage) {
    EXPECT_EQ(comp("view " + file("whole.exr") + " -o " + file("sheet.exr")).code, 2);
    EXPECT_EQ(comp("view " + file("missing.exr") + " -o " + file("sheet.png")).code, 1);
#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    const Outcome run =
        comp("view --fit --columns 3 --width 64 " + file("whole.exr") + " -o " + file("sheet.png"));
    ASSERT_EQ(run.code, 0) << run.output;
    const auto image = image::read_rgb_image(file("sheet.png"));
    ASSERT_TRUE(image.has_value());
    EXPECT_EQ(image->width, 12 + 3 * (64 + 12));
#endif
}

TEST_F(Cli, NoiseOfAMixAsTextJsonAndImage) {
    const std::string look = " --gain indirect=+2st --shadow key=0.3";
    const Outcome text = comp("noise --target 10% " + file("whole.exr") + look);
    ASSERT_EQ(text.code, 0) << text.output;
    for (const char* word : {"as rendered", "this mix", "times the samples", "--gain indirect",
                             "by group", "by bounce", "S_key"}) {
        EXPECT_NE(text.output.find(word), std::string::npos) << word << " in " << text.output;
    }
    ASSERT_TRUE(write_file_atomically(file("stats.json"), R"({"phases_s": {"render": 30}})"));
    const Outcome run = comp("noise --json --target 2% --stats " + file("stats.json") + " " +
                             file("whole.exr") + look + " -o " + file("noise.exr"));
    ASSERT_EQ(run.code, 0) << run.output;
    const auto json = nlohmann::json::parse(run.output);
    const double ratio = json["mix"]["value"].get<double>() / 0.02;
    EXPECT_NEAR(json["advice"]["sampleFactor"].get<double>(), ratio * ratio, 1e-6 * ratio * ratio);
    EXPECT_NEAR(json["advice"]["seconds"].get<double>(), 30 * ratio * ratio, 1e-4 * ratio * ratio);
    EXPECT_EQ(json["advice"]["caps"].size(), 2u);
    const auto map = image::read_exr(file("noise.exr"));
    ASSERT_TRUE(map.has_value());
    EXPECT_NE(map->find("relative"), nullptr);
#ifdef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    const Outcome heat = comp("noise " + file("whole.exr") + look + " -o " + file("noise.png"));
    ASSERT_EQ(heat.code, 0) << heat.output;
    EXPECT_NE(heat.output.find("noise.png: black "), std::string::npos) << heat.output;
    const auto image = image::read_rgb_image(file("noise.png"));
    ASSERT_TRUE(image.has_value());
    expect_scale(*image, 17);
#endif
}

TEST_F(Cli, NoiseTakesNoNonsense) {
    EXPECT_EQ(comp("noise").code, 2);
    for (const char* target : {"0", "-1%", "x", "1 %", "nan", ""}) {
        EXPECT_EQ(comp("noise " + file("whole.exr") + " --target '" + target + "'").code, 2)
            << target;
    }
    EXPECT_EQ(comp("noise " + file("whole.exr") + " -o " + file("n.gif")).code, 2);
    EXPECT_EQ(comp("noise " + file("whole.exr") + " --gain moon=2").code, 2);
    EXPECT_EQ(comp("noise " + file("missing.exr")).code, 1);
    ASSERT_TRUE(write_file_atomically(file("no_stats.json"), "[1]"));
    EXPECT_EQ(comp("noise " + file("whole.exr") + " --stats " + file("no_stats.json")).code, 1);
    EXPECT_EQ(comp("noise " + file("whole.exr") + " -o /dev/null/n.exr").code, 1);
}

TEST_F(Cli, GainsAndExposuresAreBounded) {
    const std::string mix = "mix " + file("whole.exr") + " -o " + file("bound.exr");
    for (const char* bad : {" --exposure 65", " --exposure inf", " --gain key=+200st",
                            " --gain key=+40st --exposure 40"}) {
        const Outcome run = comp(mix + bad);
        EXPECT_EQ(run.code, 2) << bad << ": " << run.output;
    }
    EXPECT_FALSE(fs::exists(file("bound.exr")));
    ASSERT_EQ(comp(mix + " --exposure 40 --save-preset " + file("bright.json")).code, 0);
    const Outcome twice = comp(mix + " --exposure 40 --preset " + file("bright.json"));
    EXPECT_EQ(twice.code, 2);
    EXPECT_NE(twice.output.find("+80 stops"), std::string::npos) << twice.output;
}

TEST_F(Cli, MixesASequence) {
    for (const char* frame : {"01", "02", "04"}) {
        fs::copy_file(file("whole.exr"), file(std::string("seq.") + frame + ".exr"),
                      fs::copy_options::overwrite_existing);
    }
    const std::string all = "mix " + file("seq.##.exr") + " -o " + file("out.##.exr");
    const Outcome there = comp(all + " --gain key=1@1,0@4");
    EXPECT_EQ(there.code, 0) << there.output;
    EXPECT_NE(there.output.find("has no frames 3"), std::string::npos) << there.output;
    EXPECT_NE(there.output.find("(3 of 3)"), std::string::npos) << there.output;
    EXPECT_EQ(comp("diff -q " + file("out.01.exr") + " " + file("out.04.exr")).code, 4);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " --mute key -o " + file("muted.exr")).code, 0);
    EXPECT_EQ(comp("diff -q " + file("muted.exr") + " " + file("out.04.exr")).code, 0);
    const Outcome asked = comp(all + " --frames 1-4 -q");
    EXPECT_EQ(asked.code, 1);
    EXPECT_NE(asked.output.find("1 of 4 frames are missing: 3"), std::string::npos) << asked.output;
    EXPECT_EQ(comp(all + " --frames x").code, 2);
    EXPECT_EQ(comp("mix " + file("seq.##.exr") + " -o " + file("one.exr")).code, 2);
    EXPECT_EQ(comp("mix " + file("whole.exr") + " -o " + file("one.exr") + " --frames 1").code, 2);
    const std::string keyed =
        "mix " + file("whole.exr") + " -o " + file("k.exr") + " --gain key=1@1,0@4";
    EXPECT_EQ(comp(keyed).code, 2);
    EXPECT_EQ(comp(keyed + " --frame 4").code, 0);
    EXPECT_EQ(comp("diff -q " + file("muted.exr") + " " + file("k.exr")).code, 0);
}

TEST_F(Cli, ControlsKeepTheirOrderAndTheirMattes) {
    const std::string saved = file("ordered.json");
    const Outcome run = comp(
        "mix " + file("whole.exr") + " -o " + file("x.exr") + " --mute sky --gain key=2 --solo " +
        "key --gain fill=3 --rows warm=key,fill --gain warm=0.5 --save-preset " + saved);
    ASSERT_EQ(run.code, 0) << run.output;
    const auto json = nlohmann::json::parse(*read_file(saved));
    std::string order;
    for (const auto& c : json["controls"])
        order += c["do"].get<std::string>() + ":" + c["name"].get<std::string>() + " ";
    EXPECT_EQ(order, "mute:sky gain:key solo:key gain:fill gain:warm ");
    EXPECT_EQ(json["rows"]["warm"].size(), 2u);
    const std::string mix = "mix " + file("whole.exr") + " -o " + file("m.exr");
    const Outcome none = comp(mix + " --gain key=2 --matte CryptoObject:/World/Tree");
    EXPECT_EQ(none.code, 2);
    EXPECT_NE(none.output.find("no Cryptomatte 'CryptoObject'"), std::string::npos) << none.output;
    EXPECT_EQ(comp(mix + " --matte CryptoObject:/World/Tree --gain key=2").code, 2);
    // An image of the same file cuts as well
    const Outcome cut = comp(mix + " --gain key=0 --matte " + file("whole.exr") + ":A");
    EXPECT_EQ(cut.code, 0) << cut.output;
    const Outcome lenient = comp(mix + " --lenient --gain moon=2 --gain key=2");
    EXPECT_EQ(lenient.code, 0);
    EXPECT_NE(lenient.output.find("skipped --gain moon"), std::string::npos) << lenient.output;
}

/// An option is honored or refused, never passed over.
TEST_F(Cli, NoOptionIsIgnored) {
    fs::copy_file(file("whole.exr"), file("ign.01.exr"), fs::copy_options::overwrite_existing);
    const std::string mix = "mix " + file("whole.exr") + " -o " + file("ign.exr");
    const std::string matte = " --matte " + file("whole.exr") + ":A";
    for (const std::string& bad :
         {"mix " + file("ign.##.exr") + " -o " + file("ign_out.##.exr") + " --frame 1",
          mix + " --gain key=2" + matte + matte,
          "mix " + file("whole.exr") + " -o " + file("ign.png") + " --with-layers",
          "plan " + file("whole.exr") + " -o " + file("ign.json") + " --stats x.json",
          "plan " + file("whole.exr") + " -o " + file("ign.json") + " --stats x.json --target 1%",
          "info --hash --json " + file("whole.exr"),
          "diff -q --json " + file("whole.exr") + " " + file("whole.exr")}) {
        const Outcome run = comp(bad);
        EXPECT_EQ(run.code, 2) << bad << "\n" << run.output;
    }
    for (const char* name : {"ign.exr", "ign.png", "ign_out.01.exr", "ign.json"})
        EXPECT_FALSE(fs::exists(file(name))) << name;
    // One per control
    EXPECT_EQ(comp(mix + " --gain key=2" + matte + " --gain fill=2" + matte).code, 0);
}

TEST_F(Cli, PresetDiffTellsWhatChanged) {
    for (const char* look : {"a.json --gain key=2", "b.json --gain key=3 --mute sky"}) {
        const std::string text = look;
        const size_t space = text.find(' ');
        ASSERT_EQ(comp("mix " + file("whole.exr") + " -o " + file("p.exr") + text.substr(space) +
                       " --save-preset " + file(text.substr(0, space)))
                      .code,
                  0);
    }
    const Outcome diff = comp("preset diff " + file("a.json") + " " + file("b.json"));
    EXPECT_EQ(diff.code, 4);
    EXPECT_EQ(diff.output, "  --gain key 2 -> 3\n+ --mute sky on\n");
    EXPECT_EQ(comp("preset diff " + file("a.json") + " " + file("a.json")).code, 0);
    EXPECT_EQ(comp("preset diff " + file("a.json") + " " + file("none.json")).code, 1);
    EXPECT_EQ(comp("preset").code, 2);
}

TEST_F(Cli, MergeGivesTheHashOfTheSingleRender) {
    const Outcome merged =
        comp("merge " + file("left.exr") + " " + file("right.exr") + " -o " + file("merged.exr"));
    ASSERT_EQ(merged.code, 0) << merged.output;
    EXPECT_EQ(comp("verify " + file("merged.exr")).code, 0);
    const Outcome a = comp("info --hash " + file("merged.exr")),
                  b = comp("info --hash " + file("whole.exr"));
    EXPECT_EQ(a.output, b.output);
    EXPECT_EQ(a.output.size(), 65u);
    EXPECT_EQ(
        comp("merge " + file("left.exr") + " " + file("whole.exr") + " -o " + file("no.exr")).code,
        5);
    EXPECT_FALSE(fs::exists(file("no.exr")));
}

TEST_F(Cli, InfoListsLayersGroupsAndShares) {
    const Outcome text = comp("info " + file("whole.exr"));
    EXPECT_EQ(text.code, 0);
    for (const char* word : {"b1_key", "/World/FillB", "C.<L.'key'>", "--replay 5,3,6"}) {
        EXPECT_NE(text.output.find(word), std::string::npos) << word;
    }
    const auto json = nlohmann::json::parse(comp("info --json " + file("whole.exr")).output);
    EXPECT_GT(json["channels"].get<int>(), 100);
    EXPECT_GT(json["bytes"].get<size_t>(), 20u * 17u * 2u * 100u);
    EXPECT_EQ(json["software"], "velatura");
    EXPECT_NE(text.output.find("without compression"), std::string::npos);
    double bounces = 0, groups = 0;
    for (const auto& layer : json["layers"]) {
        if (layer["family"] == "bounces") bounces += layer["energyShare"].get<double>();
        if (layer["family"] == "groups") groups += layer["energyShare"].get<double>();
    }
    // Every family holds all the light, up to half rounding
    EXPECT_NEAR(bounces, 1.0, 1e-3);
    EXPECT_NEAR(groups, 1.0, 1e-3);
}

}  // namespace
}  // namespace velatura::compositor::cli
