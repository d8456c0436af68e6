// SPDX-License-Identifier: Apache-2.0
// The window of a render, on a screen without a monitor, moved by mouse and keys.
#include "app/command.h"
#include "base/atomic_file.h"
#include "compositor/outcome.h"
#include "image/formats.h"
#include "virtual_screen.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace velatura::view {
namespace {

using compositor::Outcome;
using compositor::run;
using compositor::window::VirtualScreen;

const std::string bin = VELATURA_BIN_DIR;

const std::string options = " --res 96 64 --spp 8 --bounces 1 --seed 3 -q";

class ViewWindowTest : public testing::Test {
  protected:
    void SetUp() override {
#if !defined(VELATURA_HAVE_WINDOW) || !defined(VELATURA_HAVE_OPENIMAGEIO_PLUGIN)
        GTEST_SKIP() << "the window or the plugin that writes its pictures was not built";
#else
        if (!VirtualScreen::is_installed()) GTEST_SKIP() << "there is no Xvfb";
        screen_ = VirtualScreen::start(1920, 1080);
        ASSERT_TRUE(screen_) << "Xvfb does not start";
        w_.write("scene.usda", test::small_scene());
#endif
    }

    Outcome play(const std::string& arguments, const std::string& script) const {
        w_.write("script.txt", script);
        return run("cd " + w_.path("") + " && env DISPLAY=" + screen_->display() +
                   " LIBGL_ALWAYS_SOFTWARE=1 OCIO= XDG_STATE_HOME=" + w_.path("state") +
                   " timeout 240 " + bin + "/velatura view scene.usda" + options +
                   " --size 1280 800 --script script.txt " + arguments);
    }

    void expect_same_image(const std::string& a, const std::string& b) const {
        const auto first = image::read_rgb_image(w_.path(a), image::SourceColorSpace::Raw);
        const auto second = image::read_rgb_image(w_.path(b), image::SourceColorSpace::Raw);
        ASSERT_TRUE(first.has_value() && second.has_value()) << a << " " << b;
        ASSERT_EQ(first->width, second->width);
        EXPECT_TRUE(first->pixels == second->pixels) << a << " differs from " << b;
    }

    std::string bytes(const std::string& name) const {
        return read_file(w_.path(name)).value_or("missing: " + name);
    }

    test::Workplace w_;
    std::unique_ptr<VirtualScreen> screen_;
};

TEST_F(ViewWindowTest, WhatConvergesIsTheFileAndTheMixOfTheCommands) {
    const Outcome played =
        play("-o live.exr",
             "frames 10\nclick \"mute key\"\nwait\nkey 1\nwait\nscreenshot muted.png picture\n"
             "key ctrl+z\nwait\nscreenshot seen.png picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
    ASSERT_EQ(w_.comp("mix command.exr -o mix.png").exit_code, 0);
    expect_same_image("seen.png", "mix.png");
    ASSERT_EQ(w_.comp("mix command.exr --mute key -o mix_muted.png").exit_code, 0);
    expect_same_image("muted.png", "mix_muted.png");
}

TEST_F(ViewWindowTest, TheMouseMovesTheCameraPicksAndSavesEdits) {
    const Outcome played =
        play("--edits look.usda --times",
             "wait\nwhole pause\nwhole write\nclick camera\nclick picture\nframes 5\n"
             "screenshot status.png status\n"
             "drag picture 60 25\nwait\nkey 1\nwait\nscreenshot orbited.png picture\n"
             "key ctrl+shift+s\nkey ctrl+s\nframes 20\nwait\n"
             "click \"reset camera\"\nwait\nscreenshot back.png picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    EXPECT_NE(played.output.find("first drafts"), std::string::npos) << played.output;
    // The camera that was saved is the one that was seen
    const test::CommandResult rendered =
        w_.velatura("render scene.usda --session look.usda -o edited.exr" + options);
    ASSERT_EQ(rendered.exit_code, 0) << rendered.output;
    const test::CommandResult same = w_.comp("diff scene.exr edited.exr");
    EXPECT_NE(same.exit_code, 2) << same.output;
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    ASSERT_EQ(w_.comp("mix command.exr -o mix.png").exit_code, 0);
    expect_same_image("back.png", "mix.png");
    ASSERT_EQ(w_.comp("mix scene.exr -o orbited_mix.png").exit_code, 0);
    expect_same_image("orbited.png", "orbited_mix.png");
}

TEST_F(ViewWindowTest, FadersBecomeLightsAndAreUndone) {
    const Outcome played = play("--edits look.usda -o live.exr",
                                "wait\ndrag \"gain key\" 40 0\nwait\nclick \"mute sky\"\nwait\n"
                                "click \"bake lights\"\nframes 5\nwait\nkey ctrl+shift+s\n"
                                "frames 5\nkey 1\nwait\nscreenshot baked.png picture\n"
                                "screenshot status.png status\n"
                                "key z\nframes 5\nwait\n");
    ASSERT_EQ(played.code, 0) << played.output;
    const std::string edits = bytes("look.usda");
    EXPECT_NE(edits.find("over \"sky\""), std::string::npos) << edits;
    EXPECT_EQ(edits.find("Camera"), std::string::npos) << "the camera is that of the scene";
    ASSERT_EQ(w_.velatura("render scene.usda --session look.usda -o baked.exr" + options).exit_code,
              0);
    ASSERT_EQ(w_.comp("mix baked.exr -o baked_mix.png").exit_code, 0);
    expect_same_image("baked.png", "baked_mix.png");
    // Undone: the lights of the scene again
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
}

/// Redo takes the faders that are baked again, and no other.
TEST_F(ViewWindowTest, ABakeThatIsDoneAgainLeavesOtherFaders) {
    const Outcome played = play("--edits look.usda -o live.exr",
                                "wait\ndrag \"gain key\" 40 0\nwait\nclick \"bake lights\"\n"
                                "frames 5\nwait\nkey ctrl+shift+s\nframes 5\nkey z\nframes 5\n"
                                "wait\nkey ctrl+r\nframes 3\nclick \"mute sky\"\nframes 3\n"
                                "key shift+z\nframes 5\nwait\nkey 1\nwait\n"
                                "screenshot redone.png picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(w_.velatura("render scene.usda --session look.usda -o baked.exr" + options).exit_code,
              0);
    ASSERT_EQ(w_.comp("mix baked.exr -o redone_mix.png --mute sky").exit_code, 0);
    expect_same_image("redone.png", "redone_mix.png");
}

/// Numbers, axes in the image, a region, a snapshot, undo: the file is that of the saved layer.
TEST_F(ViewWindowTest, SingleLightsAreEditedByNumbersAndByTheirAxes) {
    const Outcome played =
        play("--edits look.usda -o live.exr",
             "wait\nclick \"page Scene\"\nframes 3\nclick \"edit /W/lamp\"\nframes 3\n"
             "click intensity double\ntype 25\nkey enter\nframes 5\nwait\n"
             "click temperature\nframes 5\nwait\n"
             "drag \"axis y\" 0 -12\nframes 5\nwait\n"
             "drag \"axis x\" 20 0 ctrl\nframes 5\nwait\n"
             "key ctrl+shift+s\nframes 5\nkey 1\nwait\n"
             "click \"lights in image\"\nframes 3\nscreenshot edited.png picture\n"
             "key t\nframes 3\nwhole \"snapshot 1\"\nwhole \"look of snapshot 1\"\n");
    ASSERT_EQ(played.code, 0) << played.output;
    const std::string edits = bytes("look.usda");
    EXPECT_NE(edits.find("over \"lamp\""), std::string::npos) << edits;
    EXPECT_NE(edits.find("float inputs:intensity = 25"), std::string::npos) << edits;
    EXPECT_NE(edits.find("bool inputs:enableColorTemperature = true"), std::string::npos) << edits;
    EXPECT_NE(edits.find("matrix4d xformOp:transform:view"), std::string::npos) << edits;
    EXPECT_EQ(edits.find("Cam"), std::string::npos) << "the camera is that of the scene";
    ASSERT_EQ(
        w_.velatura("render scene.usda --session look.usda -o edited.exr" + options).exit_code, 0);
    EXPECT_EQ(w_.hash("live.exr"), w_.hash("edited.exr"));
    ASSERT_EQ(w_.comp("mix edited.exr -o edited_mix.png").exit_code, 0);
    expect_same_image("edited.png", "edited_mix.png");
}

TEST_F(ViewWindowTest, TheLensIsFocusedByAClickAndTheRegionIsTheCrop) {
    const Outcome played =
        play("--edits look.usda -o live.exr",
             "wait\nclick \"page Scene\"\nframes 3\n"
             "click f-stop double\ntype 0.5\nkey enter\nframes 5\nwait\n"
             "click \"pick focus\"\nclick picture\nframes 10\nwait\n"
             "key ctrl+shift+s\nframes 5\nkey 1\nwait\nscreenshot lens.png picture\n"
             "key ctrl+b\ndrag picture 24 16\nframes 5\nwait\nwhole \"region frame\"\n"
             "key ctrl+s\nframes 5\nwait\n");
    ASSERT_EQ(played.code, 0) << played.output;
    const std::string edits = bytes("look.usda");
    EXPECT_NE(edits.find("float fStop = 0.5"), std::string::npos) << edits;
    EXPECT_NE(edits.find("float focusDistance = "), std::string::npos) << edits;
    const std::string with = "render scene.usda --session look.usda" + options;
    ASSERT_EQ(w_.velatura(with + " -o lens.exr").exit_code, 0);
    ASSERT_EQ(w_.comp("mix lens.exr -o lens_mix.png").exit_code, 0);
    expect_same_image("lens.png", "lens_mix.png");
    // From the middle, 24 x 16 pixels: of 96 x 64 the fourth of each side
    ASSERT_EQ(w_.velatura(with + " -o crop.exr --crop 0.5 0.75 0.25 0.5").exit_code, 0);
    EXPECT_EQ(w_.hash("live.region.exr"), w_.hash("crop.exr"));
}

TEST_F(ViewWindowTest, WhatIsDenoisedIsWhatTheCommandsDenoise) {
    const Outcome played = play("-o live.exr --halves",
                                "wait\nkey d\nwait\nkey 1\nwait\n"
                                "screenshot denoised.png picture\nkey d\nwait\n"
                                "screenshot plain.png picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(w_.comp("denoise live.exr -o denoised.exr").exit_code, 0);
    ASSERT_EQ(w_.comp("mix denoised.exr -o denoised_mix.png").exit_code, 0);
    expect_same_image("denoised.png", "denoised_mix.png");
    ASSERT_EQ(w_.comp("mix live.exr -o plain_mix.png").exit_code, 0);
    expect_same_image("plain.png", "plain_mix.png");
}

/// The image that is frozen as B stays while A is edited.
TEST_F(ViewWindowTest, AFrozenImageStaysBesideTheOneThatGoesOn) {
    const Outcome played =
        play("-o live.exr",
             "wait\nkey shift+t\nframes 3\nwait\nclick \"page Scene\"\nframes 3\n"
             "click \"edit /W/key\"\nframes 3\nclick intensity double\ntype 1\nkey enter\n"
             "frames 5\nwait\nclick \"lights in image\"\nkey x\nkey w\nkey 1\nwait\n"
             "screenshot frozen.png picture\nkey x\nwait\nscreenshot edited.png picture\n");
    ASSERT_EQ(played.code, 0) << played.output;
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    ASSERT_EQ(w_.comp("mix command.exr -o frozen_mix.png").exit_code, 0);
    expect_same_image("frozen.png", "frozen_mix.png");
    ASSERT_EQ(w_.comp("mix live.exr -o edited_mix.png").exit_code, 0);
    expect_same_image("edited.png", "edited_mix.png");
}

TEST_F(ViewWindowTest, ASceneThatCannotBeReadClosesIt) {
    w_.write("scene.usda", "no scene");
    const Outcome broken = play("", "wait\n");
    EXPECT_EQ(broken.code, 1) << broken.output;
    EXPECT_NE(broken.output.find("scene.usda"), std::string::npos) << broken.output;
}

TEST(ViewCommand, NeedsNeitherXNorOpenGlToRender) {
    const Outcome libraries = run("ldd " + bin + "/velatura");
    ASSERT_EQ(libraries.code, 0);
    for (const char* library : {"libX11", "libGL", "libglfw"})
        EXPECT_EQ(libraries.output.find(library), std::string::npos) << libraries.output;
}

TEST(ViewCommand, WithoutTheWindowSaysSo) {
    const test::Workplace w;
    const Outcome r =
        run("cd " + w.path("") + " && cp " + bin + "/velatura . && ./velatura view scene.usda");
    EXPECT_EQ(r.code, 1) << r.output;
    EXPECT_NE(r.output.find("libimgui-dev"), std::string::npos) << r.output;
}

}  // namespace
}  // namespace velatura::view
