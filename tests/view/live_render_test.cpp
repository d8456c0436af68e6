// SPDX-License-Identifier: Apache-2.0
#include "view/live_render.h"

#include "app/command.h"
#include "app/exit_codes.h"
#include "app/missing_assets.h"
#include "base/atomic_file.h"
#include "compositor/io/layer_stack.h"
#include "view/file_watch.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace velatura::view {
namespace {

using compositor::LayerStack;
using compositor::window::Levels;
using Phase = LiveStatus::Phase;

constexpr int width = 60, height = 41;
constexpr uint64_t samples = 24;
const std::string options = " --res 60 41 --spp 24 --bounces 2 --seed 3 -q";

app::RenderArguments arguments_of(const test::Workplace& w, const std::string& output) {
    app::RenderArguments a;
    a.scene = w.path("scene.usda");
    a.resolution = {width, height};
    a.spp = samples;
    a.bounces = "2";
    a.seed = 3;
    a.quiet = true;
    if (!output.empty()) a.output = w.path(output);
    return a;
}

void set_camera(LiveRender& render, const scene::Camera& camera, bool is_moving) {
    LiveEdits edits;
    edits.camera = camera;
    edits.is_moving = is_moving;
    render.edit(std::move(edits));
}

void set_values(LiveRender& render, std::vector<std::string> values) {
    LiveEdits edits;
    edits.values = std::move(values);
    render.edit(std::move(edits));
}

class LiveRenderTest : public testing::Test {
  protected:
    void SetUp() override {
        w_.write("scene.usda", test::small_scene());
        const test::CommandResult r = w_.velatura("render scene.usda -o command.exr" + options);
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    /// Takes layers until the render is as wanted.
    void wait(LiveRender& render, const std::function<bool(const LiveStatus&)>& is_there) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
        while (!is_there(render.status())) {
            ASSERT_LT(std::chrono::steady_clock::now(), end) << text_of(render.status());
            take(render);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        take(render);
    }

    void wait_for(LiveRender& render, Phase phase) {
        wait(render, [&](const LiveStatus& s) { return s.phase == phase; });
    }

    void take(LiveRender& render) {
        auto news = render.take();
        if (!news) return;
        ASSERT_TRUE(news->has_value()) << news->error().message;
        layers_.push_back(**news);
    }

    std::string bytes(const std::string& name) const {
        const auto read = read_file(w_.path(name));
        return read ? *read : "missing: " + name;
    }

    /// The camera of the scene, a little to the side.
    static scene::Camera moved(scene::Camera camera) {
        camera.render_from_camera[3][0] += 0.4;
        return camera;
    }

    test::Workplace w_;
    std::vector<compositor::window::RenewedLayers> layers_;
};

TEST_F(LiveRenderTest, LeftAloneWritesTheFileOfTheCommand) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait(render, [](const LiveStatus& s) { return s.messages > 0; });
    EXPECT_FALSE(render.status().is_error) << render.status().message;
    wait_for(render, Phase::Finished);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
    // Adaptive: the mean over the pixels
    EXPECT_GT(render.status().samples, 0.5 * double(samples));
    // Drafts come first; what is shown at last is what the file holds
    ASSERT_GE(layers_.size(), 1u);
    const Levels& last = *layers_.back().levels;
    EXPECT_EQ(last.reduction(), 1);
    const auto file = LayerStack::load(w_.path("command.exr"));
    ASSERT_TRUE(file.has_value());
    ASSERT_EQ(file->header().layers.size(), last.stack(0).header().layers.size());
    for (const accumulate::LayerEntry& layer : file->header().layers) {
        for (size_t c = 0; c < 3; ++c) {
            const image::Channel* stored = file->channel(layer.name, c);
            const image::Channel* shown = last.stack(0).channel(layer.name, c);
            ASSERT_EQ(stored == nullptr, shown == nullptr) << layer.name;
            EXPECT_TRUE(!stored || stored->data == shown->data) << layer.name;
        }
    }
}

TEST_F(LiveRenderTest, DraftsCoverTheImage) {
    LiveRender render(arguments_of(w_, ""), [] {});
    wait(render, [&](const LiveStatus& s) { return s.drafts > 0 && !layers_.empty(); });
    EXPECT_TRUE(layers_.front().is_other_image);
    for (const auto& renewed : layers_) {
        const Levels& levels = *renewed.levels;
        const int k = levels.reduction();
        EXPECT_EQ(levels.image_frame(), (image::Window{0, 0, width, height}));
        EXPECT_EQ(levels.frame(0),
                  (image::Window{0, 0, (width + k - 1) / k, (height + k - 1) / k}));
    }
}

TEST_F(LiveRenderTest, PausesOrbitsAndComesBackToTheSameFile) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait(render, [](const LiveStatus& s) { return s.camera.has_value(); });
    const scene::Camera first = *render.status().camera;
    render.pause(true);
    wait_for(render, Phase::Paused);
    render.pause(false);
    // A drag: cameras that follow one another, then the one that stays
    scene::Camera camera = first;
    for (int i = 0; i < 5; ++i) {
        const size_t before = render.status().drafts;
        camera = moved(camera);
        set_camera(render, camera, true);
        wait(render, [&](const LiveStatus& s) { return s.drafts > before; });
    }
    EXPECT_EQ(render.status().samples, 0) << "no more than drafts while the camera moves";
    set_camera(render, camera, false);
    wait(render, [](const LiveStatus& s) { return s.messages == 1; });
    EXPECT_EQ(render.status().message, "wrote " + w_.path("live.exr"));
    EXPECT_NE(w_.hash("live.exr"), w_.hash("command.exr"));
    // Files of other cameras do not merge
    const test::CommandResult merged = w_.comp("merge live.exr command.exr -o merged.exr");
    EXPECT_EQ(merged.exit_code, 5) << merged.output;
    set_camera(render, first, false);
    wait(render, [](const LiveStatus& s) { return s.messages == 2; });
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
}

TEST_F(LiveRenderTest, WhatIsWrittenEarlyCanBeGoneOnFrom) {
    LiveRender render(arguments_of(w_, ""), [] {});
    wait(render, [](const LiveStatus& s) { return s.samples > 1; });
    render.pause(true);
    wait_for(render, Phase::Paused);
    render.save(w_.path("early.exr"));
    wait(render, [](const LiveStatus& s) { return s.messages == 1; });
    EXPECT_FALSE(render.status().is_error) << render.status().message;
    const test::CommandResult r = w_.velatura("render scene.usda -o early.exr --resume" + options);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_EQ(w_.hash("early.exr"), w_.hash("command.exr"));
}

TEST_F(LiveRenderTest, EndsAtAnyMoment) {
    for (const int delay_ms : {0, 5, 20, 50, 100}) {
        LiveRender render(arguments_of(w_, ""), [] {});
        std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
    }
    EXPECT_FALSE(w_.exists("scene.exr")) << "nobody asked for a file";
}

TEST_F(LiveRenderTest, ASceneThatCannotBeReadEndsIt) {
    app::RenderArguments a = arguments_of(w_, "");
    a.scene = w_.path("missing.usda");
    LiveRender render(a, [] {});
    wait_for(render, Phase::Ended);
    EXPECT_EQ(render.exit_code(), app::RenderError);
}

/// The scene with another radius of the ball.
std::string scene_with_radius(const std::string& radius) {
    std::string scene = test::small_scene();
    const std::string was = "double radius = 0.6";
    return scene.replace(scene.find(was), was.size(), "double radius = " + radius);
}

TEST_F(LiveRenderTest, AFileThatChangesIsReadAgain) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    size_t messages = render.status().messages;
    const auto wait_for_message = [&](const std::string& start) {
        wait(render, [&](const LiveStatus& s) {
            return s.messages > messages && s.message.starts_with(start);
        });
        messages = render.status().messages;
    };
    // Broken: the image stays, the place is named
    w_.write("scene.usda", "#usda 1.0\ndef Sphere \"Ball\"\n{\n    double radius = = 1\n}\n");
    wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
    EXPECT_TRUE(render.status().is_error);
    EXPECT_NE(render.status().message.find("scene.usda:4:"), std::string::npos)
        << render.status().message;
    messages = render.status().messages;
    const size_t loads = render.status().loads;

    // Mended, with another ball: the file is that of the command
    w_.write("scene.usda", scene_with_radius("0.45"));
    wait_for_message("wrote");
    EXPECT_GT(render.status().loads, loads);
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));

    // The same bytes again: nothing is rendered
    w_.write("scene.usda", scene_with_radius("0.45"));
    wait_for_message("read again: nothing");
    wait_for(render, Phase::Finished);
}

/// A file that is written states what its own image lacks.
TEST_F(LiveRenderTest, AScenePartThatIsMissingCountsForTheImageThatIsShown) {
    const std::string whole = test::small_scene();
    std::string lacking = whole;
    lacking.insert(lacking.find("(\n") + 2, "    subLayers = [@missing.usda@]\n");
    w_.write("scene.usda", lacking);
    LiveRender render(arguments_of(w_, ""), [] {});
    wait_for(render, Phase::Finished);
    const std::vector<std::string> lacks = app::missing_asset_names();
    ASSERT_EQ(lacks.size(), 1u);
    size_t messages = render.status().messages;
    w_.write("scene.usda", "#usda 1.0\ndef Sphere = 1\n");
    wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
    EXPECT_EQ(app::missing_asset_names(), lacks) << "the image is that of before";
    messages = render.status().messages;
    w_.write("scene.usda", whole);
    wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
    EXPECT_TRUE(app::missing_asset_names().empty());
}

TEST_F(LiveRenderTest, EditedLightsAreThoseOfTheCommand) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    size_t messages = render.status().messages;
    const auto wait_for_file = [&] {
        wait(render, [&](const LiveStatus& s) {
            return s.messages > messages && s.message.starts_with("wrote");
        });
        messages = render.status().messages;
    };
    set_values(render,
               {"float /W/key.inputs:intensity=3", "color3f /W/lamp.inputs:color=(1, 0.5, 0.25)"});
    wait_for_file();
    ASSERT_EQ(w_.velatura("render scene.usda -o edited.exr --set 'float /W/key.inputs:intensity=3' "
                          "--set 'color3f /W/lamp.inputs:color=(1, 0.5, 0.25)'" +
                          options)
                  .exit_code,
              0);
    EXPECT_EQ(w_.hash("live.exr"), w_.hash("edited.exr"));
    set_values(render, {});
    wait_for_file();
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
}

/// 40 edits of lights, files and camera in a fixed random order, some of which overtake others.
TEST_F(LiveRenderTest, AnySequenceOfEditsEndsInTheImageOfTheCommand) {
    app::RenderArguments a = arguments_of(w_, "live.exr");
    a.spp = 4;
    LiveRender render(a, [] {});
    wait(render, [](const LiveStatus& s) { return s.camera.has_value(); });
    const scene::Camera first = *render.status().camera;
    std::mt19937 random(11);
    for (int i = 0; i < 40; ++i) {
        switch (random() % 4) {
            case 0:
                set_values(render, {fmt::format("float /W/key.inputs:intensity={}", random() % 9)});
                break;
            case 1:
                w_.write("scene.usda", scene_with_radius(fmt::format("0.{}", 3 + random() % 5)));
                break;
            case 2:
                set_camera(render, moved(first), random() % 2 == 0);
                break;
            default:
                set_camera(render, first, false);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 200));
    }
    w_.write("scene.usda", scene_with_radius("0.5"));
    set_camera(render, first, false);
    set_values(render, {"float /W/lamp.inputs:intensity=7"});
    // Until the last file was read and its image written
    std::this_thread::sleep_for(std::chrono::milliseconds(1600));
    wait_for(render, Phase::Finished);
    ASSERT_EQ(w_.velatura("render scene.usda -o edited.exr --set 'float "
                          "/W/lamp.inputs:intensity=7' --res 60 41 --spp 4 --bounces 2 --seed 3 -q")
                  .exit_code,
              0);
    EXPECT_EQ(w_.hash("live.exr"), w_.hash("edited.exr"));
}

/// Pixels of a channel of what is shown.
std::vector<float> shown_values(const Levels& levels, const std::string& name) {
    const image::Channel* channel = levels.stack(0).image().find(name);
    EXPECT_TRUE(channel) << name;
    std::vector<float> values;
    for (size_t i = 0; channel && i < channel->size(); ++i) values.push_back(channel->value(i));
    return values;
}

TEST_F(LiveRenderTest, ARegionIsTheCropOfTheCommandAndCostsTheWholeNothing) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    const std::vector<float> whole = shown_values(*layers_.back().levels, "R");
    const size_t messages = render.status().messages;
    // 60 x 41: a fraction of 1/20 is 3 pixels, 10/41 is 10
    const image::Window region = {15, 10, 45, 31};
    render.set_region(region);
    wait(render, [](const LiveStatus& s) { return s.region && s.phase == Phase::Finished; });
    EXPECT_EQ(render.status().region, region);
    render.save(w_.path("region.exr"));
    wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
    EXPECT_FALSE(render.status().is_error) << render.status().message;
    const std::string crop = fmt::format(" --crop 0.25 0.75 {} {}", 10.0 / 41, 31.0 / 41);
    ASSERT_EQ(w_.velatura("render scene.usda -o crop.exr" + crop + options).exit_code, 0);
    EXPECT_EQ(w_.hash("region.exr"), w_.hash("crop.exr"));
    // Around it the whole image stays
    const std::vector<float> seen = shown_values(*layers_.back().levels, "R");
    ASSERT_EQ(seen.size(), whole.size());
    const auto cropped = LayerStack::load(w_.path("crop.exr"));
    ASSERT_TRUE(cropped.has_value());
    const image::Channel* inside = cropped->channel("rgba", 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const size_t i = size_t(y) * width + size_t(x);
            const float expected =
                region.contains(x, y) ? inside->value(region.index(x, y)) : whole[i];
            ASSERT_EQ(seen[i], expected) << x << " " << y;
        }
    // Back: the film of before, without a sample more
    render.set_region(std::nullopt);
    wait(render, [](const LiveStatus& s) { return !s.region; });
    wait_for(render, Phase::Finished);
    EXPECT_EQ(shown_values(*layers_.back().levels, "R"), whole);
    render.save(w_.path("again.exr"));
    wait(render, [&](const LiveStatus& s) { return s.messages > messages + 1; });
    EXPECT_EQ(w_.hash("again.exr"), w_.hash("command.exr"));
}

TEST_F(LiveRenderTest, ARegionDuringTheRenderChangesNoBit) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait(render, [](const LiveStatus& s) { return s.samples > 1; });
    render.set_region(image::Window{5, 5, 20, 20});
    wait(render, [](const LiveStatus& s) { return s.region.has_value() && s.samples > 0; });
    render.set_region(std::nullopt);
    wait(render, [](const LiveStatus& s) { return s.messages > 0; });
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
}

TEST_F(LiveRenderTest, AnotherCameraAndLensAreThoseOfTheCommand) {
    std::string scene = test::small_scene();
    const std::string mesh = "    def Mesh \"Corner\"";
    scene.insert(scene.find(mesh), R"(    def Camera "Side"
    {
        float focalLength = 30
        double3 xformOp:translate = (1, 1.5, 5)
        float xformOp:rotateY = 15
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    }
)");
    w_.write("scene.usda", scene);
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    ASSERT_TRUE(render.status().scene);
    ASSERT_EQ(render.status().scene->cameras.size(), 2u);
    EXPECT_EQ(render.status().scene->cameras[1].path, "/W/Side");
    EXPECT_EQ(render.status().scene->cameras[1].focal_length, 30);
    const auto expect_command = [&](LiveEdits edits, const std::string& more) {
        const size_t messages = render.status().messages;
        render.edit(std::move(edits));
        wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
        EXPECT_FALSE(render.status().is_error) << render.status().message;
        ASSERT_EQ(w_.velatura("render scene.usda -o edited.exr " + more + options).exit_code, 0);
        EXPECT_EQ(w_.hash("live.exr"), w_.hash("edited.exr")) << more;
    };
    LiveEdits side;
    side.camera_prim = "/W/Side";
    expect_command(std::move(side), "--camera /W/Side");
    EXPECT_EQ(render.status().scene_camera->name, "/W/Side");
    LiveEdits lens;
    lens.values = {"float /W/Side.focalLength=45", "float /W/Side.fStop=2",
                   "float /W/Side.focusDistance=4.5"};
    expect_command(std::move(lens),
                   "--camera /W/Side --set 'float /W/Side.focalLength=45' --set 'float "
                   "/W/Side.fStop=2' --set 'float /W/Side.focusDistance=4.5'");
    EXPECT_EQ(render.status().scene->cameras[1].f_stop, 2);
    LiveEdits back;
    back.camera_prim = "";
    back.values = std::vector<std::string>();
    expect_command(std::move(back), "");
}

/// The window shows an edit as made: it is in the image once the file can be read again.
TEST_F(LiveRenderTest, AnEditWhileAFileIsBrokenIsRenderedOnceItIsMended) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    const auto wait_for_message = [&](const std::function<void()>& what, const std::string& start) {
        const size_t messages = render.status().messages;
        what();
        wait(render, [&](const LiveStatus& s) {
            return s.messages > messages && s.message.starts_with(start);
        });
    };
    const std::string broken = "#usda 1.0\ndef Sphere \"Ball\"\n{\n    double radius = = 1\n}\n";
    wait_for_message([&] { w_.write("scene.usda", broken); }, "");
    wait_for_message([&] { set_values(render, {"float /W/key.inputs:intensity=7"}); }, "");
    EXPECT_TRUE(render.status().is_error);
    wait_for_message([&] { w_.write("scene.usda", scene_with_radius("0.45")); }, "wrote");
    const std::string command =
        "render scene.usda -o command.exr --set 'float /W/key.inputs:intensity=7'" + options;
    ASSERT_EQ(w_.velatura(command).exit_code, 0);
    EXPECT_EQ(w_.hash("live.exr"), w_.hash("command.exr"));
}

TEST_F(LiveRenderTest, AnEditThatCannotBeReadLeavesTheImage) {
    LiveRender render(arguments_of(w_, "live.exr"), [] {});
    wait_for(render, Phase::Finished);
    size_t messages = render.status().messages;
    set_values(render, {"float /W/no_such_light.inputs:intensity=3"});
    wait(render, [&](const LiveStatus& s) { return s.messages > messages; });
    EXPECT_TRUE(render.status().is_error);
    ASSERT_TRUE(render.status().problems);
    ASSERT_FALSE(render.status().problems->empty());
    EXPECT_NE(render.status().problems->back().find("no_such_light"), std::string::npos);
    wait_for(render, Phase::Finished);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));
}

TEST(FileWatch, ReportsFilesThatChangedAndAreAtRest) {
    const test::Workplace w;
    w.write("a", "1");
    w.write("b", "1");
    std::atomic<int> calls = 0;
    FileWatch watch([&] { ++calls; });
    watch.watch({w.path("a"), w.path("b"), w.path("c")});
    const auto wait_for_calls = [&](int count) {
        for (int i = 0; i < 400 && calls < count; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(25));
        EXPECT_EQ(calls, count);
    };
    EXPECT_TRUE(watch.changed_files().empty());
    w.write("b", "12");
    EXPECT_EQ(watch.changed_files(), std::vector<std::string>{w.path("b")});
    wait_for_calls(1);
    w.write("c", "");
    wait_for_calls(2);
    EXPECT_EQ(watch.changed_files(), (std::vector<std::string>{w.path("b"), w.path("c")}));
    watch.watch({w.path("a")});
    w.write("b", "123");
    std::filesystem::remove(w.path("a"));
    wait_for_calls(3);
    EXPECT_EQ(watch.changed_files(), std::vector<std::string>{w.path("a")});
}

TEST(LiveArguments, OptionsWithoutEffectAreRefused) {
    app::RenderArguments a;
    EXPECT_TRUE(check_live_arguments(a).has_value());
    a.snapshot = "10s";
    const auto refused = check_live_arguments(a);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "usage");
    EXPECT_NE(refused.error().message.find("--snapshot"), std::string::npos);
}

}  // namespace
}  // namespace velatura::view
