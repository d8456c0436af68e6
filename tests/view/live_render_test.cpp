// SPDX-License-Identifier: Apache-2.0
#include "view/live_render.h"

#include "app/command.h"
#include "app/exit_codes.h"
#include "base/atomic_file.h"
#include "compositor/io/layer_stack.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
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
        render.set_camera(camera, true);
        wait(render, [&](const LiveStatus& s) { return s.drafts > before; });
    }
    EXPECT_EQ(render.status().samples, 0) << "no more than drafts while the camera moves";
    render.set_camera(camera, false);
    wait(render, [](const LiveStatus& s) { return s.messages == 1; });
    EXPECT_EQ(render.status().message, "wrote " + w_.path("live.exr"));
    EXPECT_NE(w_.hash("live.exr"), w_.hash("command.exr"));
    // Files of other cameras do not merge
    const test::CommandResult merged = w_.comp("merge live.exr command.exr -o merged.exr");
    EXPECT_EQ(merged.exit_code, 5) << merged.output;
    render.set_camera(first, false);
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
