// SPDX-License-Identifier: Apache-2.0
// Edits of camera and lights with their undo: what is rendered after them is what the command
// renders.
#include "view/scene_editor.h"

#include "app/command.h"
#include "base/atomic_file.h"
#include "base/process/memory_limit.h"
#include "view/camera_moves.h"
#include "view/light_moves.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <functional>
#include <random>
#include <string>
#include <thread>

namespace velatura::view {
namespace {

const std::string options = " --res 40 27 --spp 4 --bounces 1 --seed 3 -q";

app::RenderArguments arguments_of(const test::Workplace& w, int width, int height) {
    app::RenderArguments a;
    a.scene = w.path("scene.usda");
    a.resolution = {width, height};
    a.spp = 4;
    a.bounces = "1";
    a.seed = 3;
    a.quiet = true;
    a.output = w.path("live.exr");
    return a;
}

/// An editor and its render, as the window has them.
class SceneEditorTest : public testing::Test {
  protected:
    void SetUp() override { w_.write("scene.usda", test::small_scene()); }

    static void wait(LiveRender& render,
                     SceneEditor& editor,
                     const std::function<bool(const LiveStatus&)>& is_there) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(300);
        while (true) {
            const LiveStatus status = render.status();
            editor.note(status);
            render.take();
            if (is_there(status)) return;
            ASSERT_LT(std::chrono::steady_clock::now(), end) << text_of(status);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }

    /// Until all that was asked for is done.
    static void settle(LiveRender& render, SceneEditor& editor) {
        wait(render, editor, [&](const LiveStatus&) { return render.is_settled(); });
    }

    std::string bytes(const std::string& name) const {
        return read_file(w_.path(name)).value_or("missing: " + name);
    }

    test::Workplace w_;
};

/// One of what a hand can do.
void edit_at_random(SceneEditor& editor, const LiveStatus& status, std::mt19937& random) {
    const auto number = [&](double least, double most) {
        return least + (most - least) * double(random() % 1000) / 999;
    };
    constexpr std::array lights = {"/W/key", "/W/lamp", "/W/sky"};
    const std::string light = lights[random() % lights.size()];
    const bool is_moving = random() % 3 == 0;
    const auto set = [&](const std::string& path, const char* name, const char* type,
                         const std::string& value) {
        editor.edit("", is_moving, [&](SceneState& s) { s.values.set(path, name, type, value); });
    };
    switch (random() % 8) {
        case 0:
            return set(light, "inputs:intensity", "float", float_text(number(0, 9)));
        case 1:
            return set(light, "inputs:exposure", "float", float_text(number(-2, 2)));
        case 2:
            return set(light, "inputs:color", "color3f",
                       color_text({number(0, 1), number(0, 1), number(0, 1)}));
        case 3:
            set(light, "inputs:enableColorTemperature", "bool", "true");
            return set(light, "inputs:colorTemperature", "float", float_text(number(2000, 9000)));
        case 4: {
            for (const LiveLight& l : status.scene->lights) {
                if (l.values.path != light || !l.render_from_light) continue;
                const Mat4d turned = turned_by(moved_by(*l.render_from_light, status.scene->origin),
                                               {0, 1, 0}, number(0, 90));
                editor.edit("", is_moving, [&](SceneState& s) {
                    s.values.set_transform(light, moved_by(turned, {number(-1, 1), 0, 0}));
                });
            }
            return;
        }
        case 5:
            set("/W/Cam", "fStop", "float", float_text(number(0.5, 8)));
            return set("/W/Cam", "focusDistance", "float", float_text(number(1, 9)));
        case 6:
            return set("/W/Cam", "focalLength", "float", float_text(number(15, 40)));
        default:
            editor.move_camera(
                "", is_moving,
                orbit(*editor.camera(), Vec3d(0, -1, -4), {0, 1, 0}, number(-9, 9), number(-5, 5)));
    }
}

TEST_F(SceneEditorTest, TwoHundredRandomEditsAndTheirUndoEndInTheBitsOfTheCommand) {
    LiveRender render(arguments_of(w_, 40, 27), [] {});
    SceneEditor editor(render);
    wait(render, editor, [&](const LiveStatus&) { return editor.camera() != nullptr; });
    std::mt19937 random(5);
    size_t steps = 0;
    for (int i = 0; i < 200; ++i) {
        edit_at_random(editor, render.status(), random);
        ++steps;
        editor.note(render.status());
        if (random() % 2 == 0) editor.seal();
        std::this_thread::sleep_for(std::chrono::milliseconds(random() % 12));
    }
    editor.seal();
    settle(render, editor);
    EXPECT_TRUE(editor.is_changed());
    // What is edited is what the command makes of the saved layer
    ASSERT_TRUE(editor.save(w_.path("look.usda")).has_value());
    ASSERT_EQ(
        w_.velatura("render scene.usda --session look.usda -o edited.exr" + options).exit_code, 0);
    // Render space is centered elsewhere for the command: the same image within rounding
    const test::CommandResult same = w_.comp("diff live.exr edited.exr");
    EXPECT_NE(same.exit_code, 2) << same.output;

    size_t undone = 0;
    while (editor.undo()) ++undone;
    EXPECT_GE(undone, steps);
    EXPECT_FALSE(editor.is_changed());
    settle(render, editor);
    ASSERT_EQ(w_.velatura("render scene.usda -o command.exr" + options).exit_code, 0);
    EXPECT_TRUE(bytes("live.exr") == bytes("command.exr"));

    const std::string edited = bytes("look.usda");
    while (editor.redo()) {
    }
    settle(render, editor);
    ASSERT_TRUE(editor.save(w_.path("look.usda")).has_value());
    EXPECT_EQ(bytes("look.usda"), edited);
}

/// Lights alone: the origin of render space stays, and with it every bit.
TEST_F(SceneEditorTest, ASavedLightIsTheOneThatIsSeenBitForBit) {
    LiveRender render(arguments_of(w_, 40, 27), [] {});
    SceneEditor editor(render);
    wait(render, editor, [&](const LiveStatus&) { return editor.camera() != nullptr; });
    const LiveStatus status = render.status();
    ASSERT_EQ(status.scene->lights.size(), 3u);
    for (const LiveLight& light : status.scene->lights) {
        if (light.values.path != "/W/key") continue;
        EXPECT_EQ(light.values.intensity, 8);
        EXPECT_EQ(light.group, "key");
        ASSERT_TRUE(light.render_from_light);
        const Mat4d world = moved_by(*light.render_from_light, status.scene->origin);
        EXPECT_NEAR((origin_of(world) - Vec3d(2, 2.5, 2)).length(), 0, 1e-12);
        // A drag: one step
        for (int i = 1; i <= 5; ++i)
            editor.edit("gizmo", true, [&](SceneState& s) {
                s.values.set_transform("/W/key",
                                       moved_by(turned_by(world, {0, 1, 0}, 10.0 * i), {-1, 0, 0}));
            });
        editor.seal();
    }
    editor.edit("", false, [](SceneState& s) {
        s.values.set("/W/key", "inputs:enableColorTemperature", "bool", "true");
        s.values.set("/W/key", "inputs:colorTemperature", "float", "3200");
    });
    settle(render, editor);
    ASSERT_TRUE(editor.save(w_.path("look.usda")).has_value());
    ASSERT_EQ(
        w_.velatura("render scene.usda --session look.usda -o edited.exr" + options).exit_code, 0);
    EXPECT_EQ(w_.hash("live.exr"), w_.hash("edited.exr"));
    EXPECT_TRUE(editor.undo().has_value());
    EXPECT_TRUE(editor.undo().has_value());
    EXPECT_FALSE(editor.undo().has_value()) << "two steps";
}

TEST_F(SceneEditorTest, BakedControlsComeBackWithTheirStep) {
    LiveRender render(arguments_of(w_, 20, 14), [] {});
    SceneEditor editor(render);
    wait(render, editor, [&](const LiveStatus&) { return editor.camera() != nullptr; });
    compositor::Control mute;
    mute.kind = compositor::Control::Kind::Mute;
    mute.target = "sky";
    editor.edit("", false,
                [](SceneState& s) { s.values.set("/W/sky", "inputs:intensity", "float", "0"); },
                {mute});
    const auto baked = editor.undo();
    ASSERT_TRUE(baked && baked->size() == 1);
    EXPECT_EQ(baked->front().target, "sky");
    const auto again = editor.redo();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->size(), 1u);
    EXPECT_FALSE(editor.can_redo());
}

/// Memory after many edits, which a session of a day has.
class SceneEditorMemory : public SceneEditorTest, public testing::WithParamInterface<int> {};

TEST_P(SceneEditorMemory, DoesNotGrow) {
    LiveRender render(arguments_of(w_, 16, 11), [] {});
    SceneEditor editor(render);
    wait(render, editor, [&](const LiveStatus&) { return editor.camera() != nullptr; });
    std::mt19937 random(7);
    const auto edit = [&](int count) {
        for (int i = 0; i < count; ++i) {
            edit_at_random(editor, render.status(), random);
            editor.seal();
            // Each of them is read and drawn
            const size_t drafts = render.status().drafts;
            wait(render, editor,
                 [&](const LiveStatus& s) { return s.drafts > drafts || render.is_settled(); });
        }
        settle(render, editor);
        return double(resident_bytes()) / 1e6;
    };
    const int warm_up = std::max(GetParam() / 10, 200);
    const double before = edit(warm_up), after = edit(GetParam() - warm_up);
    fmt::print("{} edits: {:.1f} MB after {}, {:.1f} MB after all\n", GetParam(), before, warm_up,
               after);
    RecordProperty("growth_mb", fmt::format("{:.1f}", after - before));
    EXPECT_LT(after - before, 12) << "MB";
}

INSTANTIATE_TEST_SUITE_P(Few, SceneEditorMemory, testing::Values(600));
INSTANTIATE_TEST_SUITE_P(TwentyThousand, SceneEditorMemory, testing::Values(20000));

}  // namespace
}  // namespace velatura::view
