// SPDX-License-Identifier: Apache-2.0
// The window itself, on a screen without a monitor, moved by mouse and keys.
#include "base/atomic_file.h"
#include "compositor/look/look_rows.h"
#include "compositor/outcome.h"
#include "compositor/random_exr.h"
#include "image/exr.h"
#include "image/formats.h"
#include "virtual_screen.h"
#include "window_stack.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace velatura::compositor::window {
namespace {

namespace fs = std::filesystem;

const std::string bin = VELATURA_BIN_DIR;

std::string file(const std::string& name) {
    return film::temporary_file("window_" + name);
}

class WindowTest : public testing::Test {
  protected:
    void SetUp() override {
#if !defined(VELATURA_HAVE_WINDOW) || !defined(VELATURA_HAVE_OPENIMAGEIO_PLUGIN)
        GTEST_SKIP() << "the window or the plugin that writes its pictures was not built";
#else
        if (!VirtualScreen::is_installed()) GTEST_SKIP() << "there is no Xvfb";
        screen_ = VirtualScreen::start(1920, 1080);
        ASSERT_TRUE(screen_) << "Xvfb does not start";
        fs::remove_all(file("state"));
        layers_ = window_file("window_layers.exr", {4, 6, 190, 107}, {0, 0, 192, 108}, 2);
#endif
    }

    /// Plays a script; images and presets lie where file() says.
    Outcome play(const std::string& arguments, const std::string& script) const {
        const std::string path = file("script.txt");
        EXPECT_TRUE(write_file_atomically(path, script).has_value());
        return run("env DISPLAY=" + screen_->display() +
                   " LIBGL_ALWAYS_SOFTWARE=1 OCIO= XDG_STATE_HOME=" + file("state") +
                   " timeout 240 " + bin + "/velatura-comp-ui " + arguments + " --script " + path);
    }

    std::unique_ptr<VirtualScreen> screen_;
    std::string layers_;
};

void expect_same_image(const std::string& a, const std::string& b) {
    const auto first = image::read_rgb_image(a, image::SourceColorSpace::Raw);
    const auto second = image::read_rgb_image(b, image::SourceColorSpace::Raw);
    ASSERT_TRUE(first.has_value() && second.has_value());
    ASSERT_EQ(first->width, second->width);
    ASSERT_EQ(first->height, second->height);
    EXPECT_TRUE(first->pixels == second->pixels) << a << " differs from " << b;
}

TEST_F(WindowTest, TheSavedPresetIsTheImageOnTheScreen) {
    const std::string preset = file("preset.json");
    const Outcome played = play(layers_ + " --size 1280 800",
                                "wait\n"
                                "key 1\n"
                                "wait\n"
                                "screenshot " +
                                    file("opened.png") +
                                    " picture\n"
                                    "drag \"gain key\" 30 0\n"
                                    "wait\n"
                                    "screenshot " +
                                    file("dragged.png") +
                                    " picture\n"
                                    "click \"solo fill\"\n"
                                    "wait\n"
                                    "screenshot " +
                                    file("soloed.png") +
                                    " picture\n"
                                    "key ctrl+z\n"
                                    "click \"mute sky\"\n"
                                    "drag exposure 20 0 shift\n"
                                    "key ctrl+s\n"
                                    "type " +
                                    preset +
                                    "\n"
                                    "key enter\n"
                                    "wait\n"
                                    "screenshot " +
                                    file("final.png") + " picture\n");
    ASSERT_EQ(played.code, 0) << played.output;

    const auto text = read_file(preset);
    ASSERT_TRUE(text.has_value());
    const auto look = look_from_json(*text);
    ASSERT_TRUE(look.has_value());
    EXPECT_GT(row_state(*look, "key").stops, 0.5f);
    EXPECT_TRUE(row_state(*look, "sky").is_muted);
    EXPECT_FALSE(row_state(*look, "fill").is_soloed);
    EXPECT_GT(look->exposure_stops, 0);

    const auto mix = [&](const std::string& options, const std::string& name) {
        const Outcome mixed = run("env OCIO= " + bin + "/velatura-comp mix " + layers_ + " " +
                                  options + " -o " + file(name));
        ASSERT_EQ(mixed.code, 0) << mixed.output;
    };
    mix("", "plain.png");
    expect_same_image(file("opened.png"), file("plain.png"));
    mix("--preset " + preset, "mixed.png");
    expect_same_image(file("final.png"), file("mixed.png"));
    const auto value = control_text(look->controls.at(0)).substr(std::string("gain key ").size());
    mix("--gain key=" + value, "gained.png");
    expect_same_image(file("dragged.png"), file("gained.png"));
    mix("--gain key=" + value + " --solo fill", "solo.png");
    expect_same_image(file("soloed.png"), file("solo.png"));
}

TEST_F(WindowTest, MouseAndKeysReachTheMixer) {
    const std::string preset = file("keys.json");
    const Outcome played = play(layers_,
                                "wait\n"
                                // A double click takes the gain back
                                "drag \"gain fill\" -40 0\n"
                                "click \"gain fill\" double\n"
                                "click \"mute key\" alt\n"
                                "click \"name sky\"\n"
                                "key right\n"
                                "key shift+right\n"
                                "click \"stops key\" double\n"
                                "type 2.5\n"
                                "key enter\n"
                                "click \"page Bounces\"\n"
                                "click \"mute b2\"\n"
                                "click \"page Light × bounce\"\n"
                                "drag \"cell key:b1\" 50 0\n"
                                "click \"page Shadows\"\n"
                                "drag \"shadow key\" 60 0\n"
                                "key ctrl+s\n"
                                "type " +
                                    preset +
                                    "\n"
                                    "key enter\n"
                                    "wait\n");
    ASSERT_EQ(played.code, 0) << played.output;
    const auto text = read_file(preset);
    ASSERT_TRUE(text.has_value());
    const auto look = look_from_json(*text);
    ASSERT_TRUE(look.has_value());
    EXPECT_EQ(row_state(*look, "fill"), RowState());
    EXPECT_TRUE(row_state(*look, "key").is_soloed);
    EXPECT_FLOAT_EQ(row_state(*look, "key").stops, 2.5f);
    EXPECT_FLOAT_EQ(row_state(*look, "sky").stops, 0.3f);
    EXPECT_TRUE(row_state(*look, "b2").is_muted);
    EXPECT_GT(row_state(*look, "key:b1").stops, 0.5f);
    EXPECT_GT(share_given(*look, Control::Kind::Shadow, "key"), 0.05f);
}

/// A file of another program with that many rows, whose names differ at their ends alone.
std::string file_of_rows(size_t count) {
    image::Image image;
    image.data = image.display = {0, 0, 32, 18};
    image::Part& part = image.parts.emplace_back();
    const auto add = [&](const std::string& name) {
        image::Channel channel;
        channel.name = name;
        channel.data = std::vector<float>(image.data.pixel_count(), 0.25f);
        part.channels.push_back(std::move(channel));
    };
    for (const char* c : {"R", "G", "B", "A"}) add(c);
    for (size_t i = 0; i < count; ++i) {
        for (const char* c : {".R", ".G", ".B"})
            add(fmt::format("a_light_group_of_the_hero_character_in_this_shot_{:03}{}", i, c));
    }
    const std::string path =
        file(fmt::format("rows{}_with_quite_a_long_name_of_its_own.exr", count));
    EXPECT_TRUE(image::write_exr(path, image).has_value());
    return path;
}

TEST_F(WindowTest, NothingIsCutOffAtAThousandPixels) {
    const std::string layers = file_of_rows(400);
    const std::string row = "a_light_group_of_the_hero_character_in_this_shot_";
    for (const char* size : {"1000 700", "1920 1080"}) {
        std::string script = "wait\nhover picture\nframes 2\nscreenshot " +
                             file(std::string("rows_") + std::string(size).substr(0, 4) + ".png") +
                             "\n";
        for (const char* mark :
             {"tool Fit",  "tool 1:1",    "exposure",     "exposure stops", "views",
              "tool A",    "tool B",      "tool Wipe",    "tool A → B",     "search",
              "row count", "gain all",    "stops all",    "tint all",       "kelvin all",
              "reset all", "page Lights", "page Shadows", "title",          "status",
              "pace",      "pixel",       "pixel mix",    "pixel screen",   "pixel alpha"})
            script += fmt::format("whole \"{}\"\n", mark);
        // The last of 400 rows is found by its number, and by keys
        script += "key ctrl+f\ntype 399\nframes 2\nwhole \"name " + row +
                  "399\"\nkey enter\nclick \"clear search\"\nframes 3\nwhole \"name " + row +
                  "399\"\nkey up\nframes 3\nwhole \"name " + row + "398\"\n";
        const Outcome played = play(layers + " --size " + size, script);
        EXPECT_EQ(played.code, 0) << size << ": " << played.output;
    }
    const Outcome cut = play(layers + " --size 1000 700", "wait\nwhole \"name " + row + "399\"\n");
    EXPECT_EQ(cut.code, 2);
    EXPECT_NE(cut.output.find("is truncated"), std::string::npos) << cut.output;
}

TEST_F(WindowTest, ATintLooksAsAnImageOfItWould) {
    const std::string preset = file("tinted.json"), image_path = file("tint_image.exr");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "tint", "name": "key", "value": "0.9,0.5,0.2"}]})")
                    .has_value());
    // An image of that color alone, shown by the command
    image::Image color;
    color.data = color.display = {0, 0, 8, 8};
    image::Part& part = color.parts.emplace_back();
    for (const auto& [name, value] :
         {std::pair{"R", 0.9f}, std::pair{"G", 0.5f}, std::pair{"B", 0.2f}}) {
        image::Channel channel;
        channel.name = name;
        channel.data = std::vector<float>(64, value);
        part.channels.push_back(std::move(channel));
    }
    ASSERT_TRUE(image::write_exr(image_path, color).has_value());
    const Outcome shown =
        run("env OCIO= " + bin + "/velatura-comp mix " + image_path + " -o " + file("tint.png"));
    ASSERT_EQ(shown.code, 0) << shown.output;
    const Outcome played = play(layers_ + " --preset " + preset,
                                "wait\nhover picture\nscreenshot " + file("swatch.png") +
                                    " \"tint key\"\nclick \"tint key\"\nframes 3\nscreenshot " +
                                    file("picker.png") + "\nkey escape\n");
    ASSERT_EQ(played.code, 0) << played.output;
    const auto expected = image::read_rgb_image(file("tint.png"), image::SourceColorSpace::Raw);
    const auto swatch = image::read_rgb_image(file("swatch.png"), image::SourceColorSpace::Raw);
    ASSERT_TRUE(expected.has_value() && swatch.has_value());
    const size_t middle = 3 * size_t(swatch->height / 2 * swatch->width + swatch->width / 2);
    for (size_t c = 0; c < 3; ++c)
        EXPECT_EQ(swatch->pixels[middle + c], expected->pixels[c]) << "channel " << c;
}

TEST_F(WindowTest, DroppedFilesAreOpenedAndZoomShowsPixels) {
    const std::string preset = file("dropped.json");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "solo", "name": "key"}]})")
                    .has_value());
    const Outcome played = play("",
                                "frames 3\n"
                                "drop " +
                                    layers_ +
                                    "\n"
                                    "wait\n"
                                    "drop " +
                                    preset +
                                    "\n"
                                    "wheel picture 3\n"
                                    "key w\n"
                                    "drag wipe 40 0\n"
                                    "wait\n"
                                    "key f\n"
                                    "key w\n"
                                    "key 1\n"
                                    "wait\n"
                                    "screenshot " +
                                    file("dropped.png") +
                                    " picture\n"
                                    "key f1\n"
                                    "frames 2\n"
                                    "click close\n"
                                    "key ctrl+q\n"
                                    "wait\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(run("env OCIO= " + bin + "/velatura-comp mix " + layers_ + " --preset " + preset +
                  " -o " + file("key.png"))
                  .code,
              0);
    expect_same_image(file("dropped.png"), file("key.png"));
}

TEST_F(WindowTest, MoreBouncesThanATableTakesAreSaid) {
    film::LayerSet set = film::test_layer_set();
    set.last_bounce = 64;
    set.matrix_layers = true;
    film::Film film({0, 0, 8, 4}, set);
    film::render(film, 0, 1);
    const std::string layers = film::temporary_file("deep.exr");
    const auto written = film.write(layers, {});
    ASSERT_TRUE(written.has_value()) << written.error().message;
    const Outcome played = play(layers,
                                "wait\n"
                                "click \"page Light × bounce\"\n"
                                "hover \"left out\"\n"
                                "hover \"cell key:b1\"\n");
    EXPECT_EQ(played.code, 0) << played.output;
}

/// The images of docs/reference/window.md: with VELATURA_WINDOW_LAYERS=atelier.exr (scenes/atelier,
/// 768 × 432, 56 samples, --halves) they are those of the page, written to VELATURA_WINDOW_PICTURES
/// and made small by `oiiotool --compression jpeg:80`.
TEST_F(WindowTest, ATourTakesTheImagesOfTheDocs) {
    const char* layers = std::getenv("VELATURA_WINDOW_LAYERS");
    const char* folder = std::getenv("VELATURA_WINDOW_PICTURES");
    const std::string out = folder ? folder : fs::path(file("x")).parent_path().string();
    const std::string light = layers ? "lamp" : "fill";
    const Outcome played = play((layers ? layers : layers_) + " --size 1280 800",
                                "wait\n"
                                "drag \"gain key\" -10 0\n"
                                "drag \"gain " +
                                    light +
                                    "\" 16 0\n"
                                    "click \"mute emissive\"\n"
                                    "key w\n"
                                    "drag wipe 80 0\n"
                                    "hover picture\n"
                                    "wait\n"
                                    "screenshot " +
                                    out +
                                    "/window_lights.jpg\n"
                                    "click \"page Light × bounce\"\n"
                                    "drag \"cell key:b2\" 60 0\n"
                                    "drag \"cell b1\" -30 0\n"
                                    "wait\n"
                                    "screenshot " +
                                    out + "/window_cells.jpg\n");
    ASSERT_EQ(played.code, 0) << played.output;
    for (const char* name : {"/window_lights.jpg", "/window_cells.jpg"}) {
        const auto image = image::read_rgb_image(out + name);
        ASSERT_TRUE(image.has_value());
        EXPECT_EQ(image->width, 1280);
        EXPECT_EQ(image->height, 800);
    }
}

TEST_F(WindowTest, KeysAreThoseOfTheFrame) {
    const std::string preset = file("keyed.json");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "gain", "name": "key", "keys": {"1": "0st", "24": "3st"}}]})")
                    .has_value());
    const Outcome played = play(layers_ + " --frame 13 --preset " + preset,
                                "wait\nkey 1\nwait\nscreenshot " + file("frame13.png") +
                                    " picture\nclick frame double\ntype 24\nkey enter\nwait\n"
                                    "screenshot " +
                                    file("frame24.png") + " picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    for (const std::string frame : {"13", "24"}) {
        const std::string mixed = file("mixed" + frame + ".png");
        ASSERT_EQ(run("env OCIO= " + bin + "/velatura-comp mix " + layers_ + " --preset " + preset +
                      " --frame " + frame + " -o " + mixed)
                      .code,
                  0);
        expect_same_image(file("frame" + frame + ".png"), mixed);
    }
}

TEST_F(WindowTest, APresetMayComeBeforeTheFile) {
    const std::string preset = file("before.json"), saved = file("after.json");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "mute", "name": "key"}]})")
                    .has_value());
    const std::string script =
        "frames 2\ndrop " + layers_ + "\nwait\nkey ctrl+s\ntype " + saved + "\nkey enter\nwait\n";
    for (const std::string& arguments : {"--preset " + preset, preset}) {
        fs::remove(saved);
        const Outcome played = play(arguments, script);
        ASSERT_EQ(played.code, 0) << played.output;
        const auto text = read_file(saved);
        ASSERT_TRUE(text.has_value());
        EXPECT_TRUE(row_state(*look_from_json(*text), "key").is_muted) << arguments;
    }
    EXPECT_EQ(play(preset + " --preset " + preset, "wait\n").code, 2);
    const Outcome missing = play(layers_ + " --preset " + file("missing.json"), "wait\n");
    EXPECT_EQ(missing.code, 1);
    EXPECT_NE(missing.output.find("missing.json"), std::string::npos) << missing.output;
}

TEST_F(WindowTest, AnImageOfAnotherLookSaysSo) {
    const std::string preset = file("other.json"), saved = file("other.png");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "mute", "name": "moon"}]})")
                    .has_value());
    const Outcome played =
        play(layers_ + " --preset " + preset, "wait\nscreenshot " + file("stale.png") +
                                                  "\nhover stale\nkey ctrl+e\ntype " + saved +
                                                  "\nkey enter\nwait\n");
    EXPECT_EQ(played.code, 0) << played.output;
    EXPECT_FALSE(fs::exists(saved));
    const Outcome good = play(layers_, "wait\nhover stale\n");
    EXPECT_EQ(good.code, 2) << "there is nothing to say";
}

TEST_F(WindowTest, SavesDoNotWaitForEachOtherAndAreDoneBeforeTheEnd) {
    std::string script = "wait\n";
    for (const char* name : {"one.exr", "two.png", "three.exr"})
        script += "key ctrl+e\ntype " + file(name) + "\nkey enter\nkey m\n";
    const Outcome played = play(layers_, script + "key ctrl+q\n");
    EXPECT_EQ(played.code, 0) << played.output;
    for (const char* name : {"one.exr", "two.png", "three.exr"})
        EXPECT_TRUE(fs::exists(file(name))) << name;
    const auto one = read_file(file("one.exr")), three = read_file(file("three.exr"));
    EXPECT_TRUE(one && three && *one == *three) << "m twice";
}

TEST_F(WindowTest, AsksBeforeItReplacesAFile) {
    const std::string image = file("replaced.png");
    ASSERT_TRUE(write_file_atomically(image, "no picture").has_value());
    const std::string save = "wait\nkey ctrl+e\ntype " + image + "\nkey enter\nframes 2\n";
    const Outcome canceled =
        play(layers_, save + "screenshot " + file("question.png") + "\nclick cancel\nwait\n");
    EXPECT_EQ(canceled.code, 0) << canceled.output;
    EXPECT_EQ(read_file(image).value(), "no picture");
    const Outcome replaced = play(layers_, save + "click replace\nwait\n");
    EXPECT_EQ(replaced.code, 0) << replaced.output;
    EXPECT_TRUE(image::read_rgb_image(image).has_value());
}

TEST_F(WindowTest, TheInputSpaceOfTheMenuIsThatOfTheCommand) {
    const Outcome mixed = run("env OCIO= " + bin + "/velatura-comp mix " + layers_ +
                              " --input-space ACEScg -o " + file("space.png"));
    ASSERT_EQ(mixed.code, 0) << mixed.output;
    const std::string shot =
        "wait\nkey 1\nwait\nscreenshot " + file("space_window.png") + " picture\n";
    const Outcome by_option = play(layers_ + " --input-space ACEScg --size 1280 800", shot);
    ASSERT_EQ(by_option.code, 0) << by_option.output;
    expect_same_image(file("space_window.png"), file("space.png"));
    const Outcome by_menu = play(layers_ + " --size 1280 800",
                                 "wait\nclick spaces\nframes 3\nscreenshot " + file("spaces.png") +
                                     "\nclick \"space ACEScg\"\n" + shot);
    ASSERT_EQ(by_menu.code, 0) << by_menu.output;
    expect_same_image(file("space_window.png"), file("space.png"));
}

TEST_F(WindowTest, ASequenceOpensAndItsNextFrameFollows) {
    const std::string folder = file("sequence");
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::string other =
        window_file("window_later.exr", {4, 6, 190, 107}, {0, 0, 192, 108}, 1);
    fs::copy_file(layers_, folder + "/shot.0003.exr");
    fs::copy_file(other, folder + "/shot.0007.exr");
    const auto shot = [](const std::string& name) {
        return "wait\nscreenshot " + file(name) + " picture\n";
    };
    const Outcome played =
        play(folder + "/shot.####.exr --size 1280 800",
             "wait\nkey 1\n" + shot("frame3.png") + "key pagedown\n" + shot("frame7.png"));
    ASSERT_EQ(played.code, 0) << played.output;
    const Outcome at_frame = play(folder + "/shot.####.exr --frame 7 --size 1280 800",
                                  "wait\nkey 1\n" + shot("at_frame7.png"));
    ASSERT_EQ(at_frame.code, 0) << at_frame.output;
    for (const auto& [shown, layers] :
         {std::pair{"frame3.png", layers_}, std::pair{"frame7.png", other},
          std::pair{"at_frame7.png", other}}) {
        ASSERT_EQ(run("env OCIO= " + bin + "/velatura-comp mix " + layers + " -o " +
                      file("frame_mixed.png"))
                      .code,
                  0);
        expect_same_image(file(shown), file("frame_mixed.png"));
    }
    const Outcome none = play(folder + "/other.####.exr", "wait\n");
    EXPECT_EQ(none.code, 1);
    EXPECT_NE(none.output.find("other.####.exr"), std::string::npos) << none.output;
}

TEST_F(WindowTest, AnotherFileIsBesideThisOne) {
    const std::string other =
        window_file("window_compared.exr", {4, 6, 190, 107}, {0, 0, 192, 108}, 1);
    // A at the whole width, then B
    const Outcome played =
        play(layers_ + " --size 1280 800",
             "wait\nkey 1\nclick \"menu File\"\nclick \"menu Compare with …\"\ntype " + other +
                 "\nkey enter\nwait\nhover picture\nscreenshot " + file("compared.png") +
                 "\nkey w\nwait\nscreenshot " + file("side_a.png") + " picture\nkey x\nwait\n" +
                 "screenshot " + file("side_b.png") + " picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    for (const auto& [shown, layers] :
         {std::pair{"side_a.png", layers_}, std::pair{"side_b.png", other}}) {
        ASSERT_EQ(
            run("env OCIO= " + bin + "/velatura-comp mix " + layers + " -o " + file("side.png"))
                .code,
            0);
        expect_same_image(file(shown), file("side.png"));
    }
}

TEST_F(WindowTest, FollowsAFileThatARenderReplaces) {
    const image::Window data = {4, 6, 190, 107}, all = {0, 0, 192, 108};
    const std::string followed = window_file("followed_layers.exr", data, all, 1),
                      next = window_file("next_layers.exr", data, all, 4),
                      fewer = plain_file("fewer_layers.exr", {0, 0, 160, 90}),
                      damaged = file("damaged.exr");
    const std::string whole = read_file(next).value();
    ASSERT_TRUE(write_file_atomically(damaged, whole.substr(0, whole.size() / 2)).has_value());
    const auto shot = [](const char* name) {
        return "wait\nscreenshot " + file(name) + " picture\n";
    };
    const Outcome played = play(
        followed + " --follow --size 1280 800",
        "wait\nkey 1\nclick \"mute key\"\n" + shot("follow_first.png") + "replace " + followed +
            " " + next + "\n" + shot("follow_next.png") + "replace " + followed + " " + damaged +
            "\n" + shot("follow_damaged.png") + "replace " + followed + " " + fewer +
            // Of another size: fitted into the window
            "\nwait\nkey 1\n" + shot("follow_fewer.png") + "key ctrl+z\n" +
            shot("follow_undone.png") +
            // Off again: what replaces the file is left alone
            "key shift+f5\nreplace " + followed + " " + next + "\nframes 30\n" +
            shot("follow_off.png"));
    ASSERT_EQ(played.code, 0) << played.output;
    expect_same_image(file("follow_damaged.png"), file("follow_next.png"));
    const auto expect_mix = [&](const std::string& layers, const std::string& options,
                                const std::string& seen) {
        const Outcome mixed = run("env OCIO= " + bin + "/velatura-comp mix " + layers + options +
                                  " -o " + file("follow_mix.png"));
        ASSERT_EQ(mixed.code, 0) << mixed.output;
        expect_same_image(file(seen), file("follow_mix.png"));
    };
    expect_mix(next, " --mute key", "follow_next.png");
    expect_mix(fewer, " --mute key", "follow_fewer.png");
    expect_mix(fewer, "", "follow_undone.png");
    expect_mix(fewer, "", "follow_off.png");
    const auto first = read_file(file("follow_first.png")),
               second = read_file(file("follow_next.png"));
    EXPECT_NE(first.value(), second.value()) << "other samples";
}

TEST_F(WindowTest, ExportsAndBakesAreThoseOfTheCommands) {
    struct Case {
        const char* menu;
        const char* command;
        const char* extension;
    };

    const std::string preset = file("exported.json");
    ASSERT_TRUE(write_file_atomically(preset, R"({"schema": "velatura.look/1", "controls": [
        {"do": "gain", "name": "key", "value": "+1st"}, {"do": "mute", "name": "fill"}]})")
                    .has_value());
    for (const Case& c : {Case{"Export to Nuke …", "export nuke", ".nk"},
                          Case{"Export to oiiotool …", "export oiio", ".sh"},
                          Case{"Export to Blender …", "export blender", ".py"},
                          Case{"Bake into lights …", "bake", ".usda"}}) {
        const std::string ours = file(std::string("ours") + c.extension),
                          theirs = file(std::string("theirs") + c.extension);
        // A Nuke script names the file from its own folder
        const fs::path layers = layers_;
        const bool is_relative = std::string(c.extension) == ".nk";
        const std::string folder = is_relative ? layers.parent_path().string() : ".",
                          input = is_relative ? layers.filename().string() : layers_;
        const Outcome command = run("cd " + folder + " && " + bin + "/velatura-comp " + c.command +
                                    " " + input + " --preset " + preset + " -o " + theirs);
        ASSERT_TRUE(write_file_atomically(ours, "something else").has_value());
        // Asks for a path, and before it replaces
        const Outcome played =
            play(layers_ + " --preset " + preset,
                 fmt::format("wait\nclick \"menu File\"\nclick \"menu {}\"\ntype {}\nkey enter\n"
                             "frames 2\nclick replace\nwait\nscreenshot {}\n",
                             c.menu, ours, file("outputs.png")));
        ASSERT_EQ(played.code, 0) << c.menu << ": " << played.output;
        if (command.code != 0) {
            // What the command cannot do, such as baking a file that does not know its lights
            EXPECT_EQ(read_file(ours).value(), "something else") << c.menu;
            continue;
        }
        EXPECT_EQ(read_file(ours).value(), read_file(theirs).value()) << c.menu;
    }
}

TEST_F(WindowTest, AKilledWindowHasLostNoLook) {
    const std::string preset = file("of_the_killed.json"), hang = "frames 10000\n";
    const std::string script = file("killed.txt");
    ASSERT_TRUE(
        write_file_atomically(script, "wait\nclick \"name key\"\nkey right\nkey m\nwait\n" + hang)
            .has_value());
    const std::string kept = file("state") + "/velatura/looks";
    // Killed as soon as both changes are on the disk
    const Outcome killed =
        run("env DISPLAY=" + screen_->display() + " LIBGL_ALWAYS_SOFTWARE=1 OCIO= XDG_STATE_HOME=" +
            file("state") + " sh -c '" + bin + "/velatura-comp-ui " + layers_ + " --script " +
            script + " & i=0; until grep -qs mute " + kept +
            "/*.json || [ $i -gt 600 ]; do sleep 0.1; i=$((i+1)); done; kill -9 $!'");
    EXPECT_EQ(killed.code, 0) << killed.output;
    const Outcome again = play(layers_, "wait\nkey ctrl+s\ntype " + preset + "\nkey enter\nwait\n");
    ASSERT_EQ(again.code, 0) << again.output;
    const auto text = read_file(preset);
    ASSERT_TRUE(text.has_value());
    const auto look = look_from_json(*text);
    ASSERT_TRUE(look.has_value());
    EXPECT_TRUE(row_state(*look, "key").is_muted);
    EXPECT_FLOAT_EQ(row_state(*look, "key").stops, 0.25f);
    EXPECT_TRUE(fs::is_empty(kept)) << "the preset holds it";
}

TEST_F(WindowTest, WhatCannotBeOpenedIsSaid) {
    const Outcome missing = play(file("missing.exr"), "wait\n");
    EXPECT_EQ(missing.code, 1);
    EXPECT_NE(missing.output.find("missing.exr"), std::string::npos) << missing.output;
    const Outcome lost = play(layers_, "wait\nclick \"mute moon\"\n");
    EXPECT_EQ(lost.code, 2);
    EXPECT_NE(lost.output.find("line 2: no 'mute moon' on the screen"), std::string::npos);
}

TEST_F(WindowTest, TheOtherEyeIsInTheMenu) {
    image::Image image;
    image.data = image.display = {0, 0, 64, 36};
    for (const char* view : {"left", "right"}) {
        image::Part& part = image.parts.emplace_back();
        part.name = std::string("rgba.") + view;
        part.attributes["view"] = std::string(view);
        for (const char* c : {"R", "G", "B"}) {
            image::Channel channel;
            channel.name = c;
            const float value = std::string(view) == "left" ? 0.1f : 0.6f;
            channel.data = std::vector<float>(image.data.pixel_count(), value);
            part.channels.push_back(std::move(channel));
        }
    }
    const std::string path = file("eyes.exr");
    ASSERT_TRUE(image::write_exr(path, image).has_value());
    const std::string shot = "wait\nkey 1\nwait\nscreenshot ";
    const Outcome played =
        play(path + " --size 1280 800",
             shot + file("eye_left.png") + " picture\nclick \"menu File\"\nframes 2\n" +
                 "click \"menu Stereo view\"\nframes 2\nclick \"stereo right\"\n" + shot +
                 file("eye_right.png") + " picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    for (const std::string eye : {"left", "right"}) {
        ASSERT_EQ(run("env OCIO= " + bin + "/velatura-comp mix " + path + " --stereo " + eye +
                      " -o " + file("eye.png"))
                      .code,
                  0);
        expect_same_image(file("eye_" + eye + ".png"), file("eye.png"));
    }
}

TEST_F(WindowTest, FilesOfOneAovEachAreRowsOfOneMix) {
    std::string paths;
    for (const auto& [name, value] : {std::pair{"key", 0.1f}, {"fill", 0.3f}}) {
        image::Image image;
        image.data = image.display = {0, 0, 64, 36};
        image::Part& part = image.parts.emplace_back();
        for (const char* c : {"R", "G", "B"}) {
            image::Channel& channel = part.channels.emplace_back();
            channel.name = c;
            channel.data = std::vector<float>(image.data.pixel_count(), value);
        }
        const std::string path = file(std::string("aov_") + name + ".exr");
        ASSERT_TRUE(image::write_exr(path, image).has_value());
        paths += path + " ";
    }
    const Outcome played =
        play(paths + " --size 1280 800",
             "wait\nkey 1\nwait\nclick \"mute key\"\nwait\nscreenshot " + file("aov_seen.png") +
                 " picture\nkey f5\nwait\nscreenshot " + file("aov_again.png") + " picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(
        run("env OCIO= " + bin + "/velatura-comp mix " + paths + "--mute key -o " + file("aov.png"))
            .code,
        0);
    expect_same_image(file("aov_seen.png"), file("aov.png"));
    expect_same_image(file("aov_again.png"), file("aov.png"));
    // A script would read the first of them alone
    const Outcome exported = run(bin + "/velatura-comp export nuke " + paths);
    EXPECT_EQ(exported.code, 2);
    EXPECT_NE(exported.output.find("--with-layers"), std::string::npos) << exported.output;
}

/// Drops file after file into one window, with a stop on each page and view.
void expect_all_open(const std::function<Outcome(const std::string&, const std::string&)>& play,
                     const std::string& first,
                     uint64_t seed,
                     uint64_t end) {
    const std::string folder = file("random");
    fs::remove_all(folder);
    fs::create_directories(folder);
    std::string script = "wait\n";
    for (; seed < end; ++seed) {
        const std::string path = fmt::format("{}/{}.exr", folder, seed);
        write_random_exr(seed, path);
        script += "drop " + path + "\nwait\nhover picture\nkey .\nkey right\nwait\n";
    }
    const Outcome played = play(first, script);
    EXPECT_EQ(played.code, 0) << played.output;
    fs::remove_all(folder);
}

TEST_F(WindowTest, OpensRandomFiles) {
    expect_all_open([&](const auto& a, const auto& s) { return play(a, s); }, layers_, 1, 21);
}

/// The others, a hundred at a time.
class RandomWindowTest : public WindowTest, public testing::WithParamInterface<uint64_t> {};

TEST_P(RandomWindowTest, OpensAHundredRandomFiles) {
    expect_all_open([&](const auto& a, const auto& s) { return play(a, s); }, layers_, GetParam(),
                    GetParam() + 99);
}

INSTANTIATE_TEST_SUITE_P(TwoThousand, RandomWindowTest, testing::Range<uint64_t>(21, 2001, 99));

#ifdef VELATURA_HAVE_WINDOW
TEST(Ui, WithoutAScreenSaysSo) {
    const Outcome ui =
        run("env -u DISPLAY -u WAYLAND_DISPLAY " + bin + "/velatura-comp ui nothing.exr");
    EXPECT_EQ(ui.code, 1);
    EXPECT_NE(ui.output.find("[no-display]"), std::string::npos) << ui.output;
}
#endif

TEST(Ui, WithoutTheWindowSaysSo) {
    // The command alone, as on a machine of a farm
    const fs::path folder = file("farm");
    fs::create_directories(folder);
    fs::copy_file(bin + "/velatura-comp", folder / "velatura-comp",
                  fs::copy_options::overwrite_existing);
    const Outcome ui = run((folder / "velatura-comp").string() + " ui nothing.exr");
    EXPECT_EQ(ui.code, 1);
    EXPECT_NE(ui.output.find("libimgui-dev"), std::string::npos) << ui.output;
}

TEST(Ui, TheCommandNeedsNeitherXNorOpenGl) {
    const Outcome libraries = run("ldd " + bin + "/velatura-comp");
    ASSERT_EQ(libraries.code, 0);
    for (const char* library : {"libX11", "libGL", "libglfw"})
        EXPECT_EQ(libraries.output.find(library), std::string::npos) << libraries.output;
}

}  // namespace
}  // namespace velatura::compositor::window
