// SPDX-License-Identifier: Apache-2.0
// The library of images from the outside: who opens it, from where, and what is said without it.
#include "command.h"
#include "image/exr.h"
#include "opened_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

namespace fs = std::filesystem;

constexpr const char* quick = " --res 12 9 --spp 1 --guiding off --progress none -q ";
constexpr const char* missing = "plugin openimageio is missing: no plugin provides ";

/// A ball with a texture.
const std::string textured = R"usda(#usda 1.0
def Camera "Cam"
{
    double3 xformOp:translate = (0, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "sky"
{
}
)usda" + textured_ball("picture.exr");

constexpr const char* mapped = R"usda(#usda 1.0
def Camera "Cam"
{
}
def DomeLight "sky"
{
    asset inputs:texture:file = @picture.exr@
}
)usda";

class ImagePlugin : public testing::Test {
  protected:
    void SetUp() override {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
        GTEST_SKIP() << "built without the plugin openimageio";
#endif
        w.write("plain.usda", small_scene());
        w.write("textured.usda", textured);
        w.write("mapped.usda", mapped);
        image::Image image;
        image.data = image.display = {0, 0, 4, 2};
        image::Part& part = image.parts.emplace_back();
        for (const char* name : {"R", "G", "B"}) {
            part.channels.push_back(image::Channel::make(name, image::ChannelType::Float, 8));
            std::get<std::vector<float>>(part.channels.back().data) = {0.1f, 0.3f, 0.5f, 0.7f,
                                                                       0.8f, 0.6f, 0.4f, 0.2f};
        }
        ASSERT_TRUE(image::write_exr(w.path("picture.exr"), image));
    }

    void expect_opened(const std::string& program, const std::string& arguments) const {
        const std::string opened = opened_files(w, program, arguments);
        EXPECT_NE(opened.find("velatura_openimageio.so"), std::string::npos) << arguments;
        EXPECT_NE(opened.find("libOpenImageIO"), std::string::npos) << arguments;
        EXPECT_EQ(opened.find("libembree"), std::string::npos) << arguments;
    }

    bool starts_decoders(const std::string& arguments) const {
        return opened_files(w, "velatura", arguments).find("velatura-decoder") != std::string::npos;
    }

    /// A copy of the program in <folder>/bin, away from the plugins of the build.
    void copy_program(const std::string& folder, const std::string& program) const {
        fs::create_directories(w.path(folder + "/bin"));
        fs::copy_file(fs::path(VELATURA_BIN_DIR) / program, w.path(folder + "/bin/" + program));
    }

    CommandResult run_copy(const std::string& folder, const std::string& arguments) const {
        // The shell takes the first word for the program: `velatura` is run for its folder alone
        return w.velatura("--version >/dev/null && " + w.path(folder + "/bin/") + arguments);
    }

    Workplace w;
};

TEST_F(ImagePlugin, IsNotOpenedWithoutImages) {
    w.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (const std::string& arguments :
         {std::string("--version"), std::string("render plain.usda -o plain.exr") + quick,
          std::string("info plain.usda"), std::string("import a.obj -o a.usda")}) {
        expect_nothing_heavy(opened_files(w, "velatura", arguments), arguments);
    }
    // OpenEXR files of layers need no other library
    for (const char* arguments :
         {"info plain.exr", "mix plain.exr -o mixed.exr", "verify plain.exr"})
        expect_nothing_heavy(opened_files(w, "velatura-comp", arguments), arguments);
}

TEST_F(ImagePlugin, IsOpenedForTexturesMapsAndDisplayImages) {
    expect_opened("velatura", std::string("render textured.usda -o textured.exr") + quick);
    expect_opened("velatura", std::string("render mapped.usda -o mapped.exr") + quick);
    expect_opened("velatura-comp", "mix mapped.exr -o mapped.png");
}

TEST_F(ImagePlugin, IsFoundInAnInstallation) {
    const std::string render = std::string("render textured.usda") + quick;
    const CommandResult built = w.velatura(render + "-o built.exr");
    ASSERT_EQ(built.exit_code, 0) << built.output;
    copy_program("usr", "velatura");
    const std::string plugins = w.path("usr/lib/velatura/plugins");
    fs::create_directories(plugins);
    fs::copy(fs::path(VELATURA_BUILT_PLUGINS) / "openimageio", plugins + "/openimageio");
    const CommandResult installed = run_copy("usr", "velatura " + render + "-o installed.exr");
    ASSERT_EQ(installed.exit_code, 0) << installed.output;
    EXPECT_EQ(installed.output, "");
    EXPECT_EQ(w.hash("installed.exr"), w.hash("built.exr"));
    // Not the image of the fallback
    copy_program("lone", "velatura");
    run_copy("lone", "velatura " + render + "-o lone.exr");
    EXPECT_NE(w.hash("lone.exr"), w.hash("built.exr"));
}

TEST_F(ImagePlugin, IsNamedWhereItIsMissing) {
    copy_program("lone", "velatura");
    copy_program("lone", "velatura-comp");
    const std::string render = std::string("velatura render textured.usda") + quick;
    const CommandResult texture = run_copy("lone", render + "-o x.exr");
    const std::string said =
        fmt::format("cannot read texture 'picture.exr': {}textures in ", missing);
    EXPECT_NE(texture.output.find(said), std::string::npos) << texture.output;
    EXPECT_NE(texture.output.find("using its fallback ("), std::string::npos);
    EXPECT_NE(texture.output.find("textured.usda:23:"), std::string::npos) << texture.output;
    EXPECT_NE(texture.output.find("lib/velatura/plugins"), std::string::npos) << texture.output;
    // Once more at the end, and in the exit code; the image is there all the same
    EXPECT_NE(texture.output.find(
                  "error: the scene needs a plugin that is not installed: plugin openimageio"),
              std::string::npos)
        << texture.output;
    EXPECT_EQ(texture.exit_code, 1);
    EXPECT_TRUE(w.exists("x.exr"));
    EXPECT_EQ(run_copy("lone", render + "-o x.exr --missing-assets ignore").exit_code, 0);
    EXPECT_EQ(run_copy("lone", render + "-o y.exr --strict").exit_code, 1);
    EXPECT_FALSE(w.exists("y.exr"));

    const CommandResult map = run_copy(
        "lone", "velatura render mapped.usda --res 12 9 --spp 1 --progress none -o map.exr");
    EXPECT_NE(map.output.find(fmt::format("picture.exr: {}pictures in ", missing)),
              std::string::npos)
        << map.output;
    EXPECT_EQ(map.exit_code, 1);

    ASSERT_EQ(
        run_copy("lone", std::string("velatura render plain.usda -o plain.exr") + quick).output,
        "");
    const CommandResult png = run_copy("lone", "velatura-comp mix plain.exr -o plain.png");
    EXPECT_EQ(png.exit_code, 1) << png.output;
    EXPECT_NE(png.output.find(missing), std::string::npos) << png.output;
    EXPECT_FALSE(w.exists("plain.png"));
}

/// Of trusted scenes images are decoded in the renderer; of others in decoder processes.
TEST_F(ImagePlugin, DecoderProcessesAreStartedForUntrustedScenesOnly) {
    for (const char* scene : {"textured", "mapped"}) {
        const std::string render = fmt::format("render {}.usda -o x.exr{}", scene, quick);
        EXPECT_FALSE(starts_decoders(render)) << scene;
        const std::string in_process = w.hash("x.exr");
        for (const char* option : {"--sandbox", "--confine", "--asset-root ."}) {
            EXPECT_TRUE(starts_decoders(render + option)) << scene << option;
            EXPECT_EQ(w.hash("x.exr"), in_process) << scene << option;
        }
    }
    ::setenv("VELATURA_ASSET_ROOTS", w.path(".").c_str(), 1);
    EXPECT_TRUE(starts_decoders(std::string("render textured.usda -o x.exr") + quick));
    ::unsetenv("VELATURA_ASSET_ROOTS");
}

/// What a decoder may take counts against the limit, unless it is much of what is left.
TEST_F(ImagePlugin, DecoderProcessesAreStartedWhereMemoryIsShort) {
    w.write("large.ppm", "P6 5000 3000 255\n" + std::string(5000 * 3000 * 3, 'x'));
    std::string scene = textured;
    scene.replace(scene.find("picture.exr"), 11, "large.ppm");
    w.write("large.usda", scene);
    const std::string render = std::string("render large.usda -o x.exr") + quick;
    EXPECT_FALSE(starts_decoders(render));
    const std::string free = w.hash("x.exr");
    EXPECT_TRUE(starts_decoders(render + "--memory-limit 300M"));
    EXPECT_EQ(w.hash("x.exr"), free);
}

/// Where they are asked for, images are not decoded in the renderer after all.
TEST_F(ImagePlugin, SaysThatItsProgramIsMissing) {
    fs::create_directories(w.path("cut"));
    fs::copy(fs::path(VELATURA_BUILT_PLUGINS) / "openimageio", w.path("cut/openimageio"));
    fs::remove(w.path("cut/openimageio/velatura-decoder"));
    ::setenv("VELATURA_PLUGIN_PATH", w.path("cut").c_str(), 1);
    const CommandResult trusted = w.velatura(std::string("render textured.usda -o z.exr") + quick);
    const CommandResult texture =
        w.velatura(std::string("render textured.usda --sandbox -o x.exr") + quick);
    const CommandResult map =
        w.velatura(std::string("render mapped.usda --sandbox -o y.exr") + quick);
    const CommandResult ignored = w.velatura(
        std::string("render textured.usda --sandbox --missing-assets ignore -o x.exr") + quick);
    ::unsetenv("VELATURA_PLUGIN_PATH");
    const std::string why =
        fmt::format("the decoder program {} is missing: No such file or directory",
                    w.path("cut/openimageio/velatura-decoder"));
    EXPECT_EQ(trusted.exit_code, 0) << trusted.output;
    EXPECT_NE(texture.output.find("cannot read texture 'picture.exr': " + why), std::string::npos)
        << texture.output;
    EXPECT_NE(map.output.find("light emits without its texture"), std::string::npos) << map.output;
    EXPECT_NE(map.output.find(why), std::string::npos) << map.output;
    // Without it the images are incomplete, and written
    EXPECT_EQ(texture.exit_code, 1);
    EXPECT_EQ(map.exit_code, 1);
    EXPECT_EQ(ignored.exit_code, 0) << ignored.output;
    EXPECT_TRUE(w.exists("x.exr") && w.exists("y.exr"));
}

/// With a program that does to itself what broken decoders do (sandbox/double_images.h).
TEST_F(ImagePlugin, ACrashOfADecoderCostsItsTextureOnly) {
    fs::create_directories(w.path("double"));
    fs::copy(fs::path(VELATURA_BUILT_PLUGINS) / "openimageio", w.path("double/openimageio"));
    fs::copy_file(VELATURA_DOUBLE_PROGRAM, w.path("double/openimageio/velatura-decoder"),
                  fs::copy_options::overwrite_existing);
    std::string scene = "#usda 1.0\ndef DomeLight \"sky\"\n{\n}\n";
    int place = 0;
    for (const std::string what : {"plain", "segv", "abort"}) {
        w.write(what + ".png", "anything");
        std::string ball = textured_ball(what + ".png");
        for (size_t at = 0; (at = ball.find("</M", at)) != std::string::npos; at += what.size() + 2)
            ball.insert(at + 2, what + "/");
        scene += fmt::format("def Xform \"{}\"\n{{\n double3 xformOp:translate = ({}, 0, 0)\n",
                             what, 3 * place++);
        scene += " uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" + ball + "}\n";
    }
    w.write("balls.usda", scene);
    ::setenv("VELATURA_PLUGIN_PATH", w.path("double").c_str(), 1);
    const CommandResult r =
        w.velatura(std::string("render balls.usda --sandbox --stats s.json -o x.exr") + quick);
    const CommandResult strict = w.velatura(
        std::string("render balls.usda --sandbox --missing-textures error -o y.exr") + quick);
    ::unsetenv("VELATURA_PLUGIN_PATH");
    EXPECT_EQ(r.exit_code, 1) << r.output;
    for (const auto& [what, signal] : {std::pair("segv", SIGSEGV), std::pair("abort", SIGABRT)}) {
        const std::string said =
            fmt::format("cannot read texture '{}.png': the decoder process was ended by signal {}",
                        what, signal);
        EXPECT_NE(r.output.find(said), std::string::npos) << r.output;
        EXPECT_NE(r.output.find(std::string("/") + what), std::string::npos) << r.output;
    }
    EXPECT_EQ(r.output.find("plain.png"), std::string::npos) << r.output;
    EXPECT_NE(w.velatura("--version >/dev/null; cat s.json").output.find("\"unread_textures\": 2"),
              std::string::npos);
    EXPECT_EQ(strict.exit_code, 1) << strict.output;
}

TEST_F(ImagePlugin, IsNamedWhereItCannotBeLoaded) {
    fs::create_directories(w.path("broken/openimageio"));
    fs::copy_file(fs::path(VELATURA_BUILT_PLUGINS) / "openimageio/plugin.txt",
                  w.path("broken/openimageio/plugin.txt"));
    w.write("broken/openimageio/velatura_openimageio.so", "this is no shared object");
    ::setenv("VELATURA_PLUGIN_PATH", w.path("broken").c_str(), 1);
    const CommandResult r = w.velatura(std::string("render textured.usda -o x.exr") + quick);
    ::unsetenv("VELATURA_PLUGIN_PATH");
    EXPECT_NE(r.output.find("'picture.exr': plugin openimageio: cannot be loaded: "),
              std::string::npos)
        << r.output;
}

}  // namespace
}  // namespace velatura::test
