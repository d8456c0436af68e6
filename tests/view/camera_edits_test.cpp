// SPDX-License-Identifier: Apache-2.0
#include "view/camera_edits.h"

#include "app/command.h"
#include "base/diagnostics.h"
#include "render/load_scene.h"
#include "view/camera_moves.h"

#include <gtest/gtest.h>

namespace velatura::view {
namespace {

scene::Camera camera_of(const std::string& path) {
    Diagnostics diagnostics;
    const auto scene = render::load_scene(path, {}, diagnostics);
    EXPECT_TRUE(scene.has_value());
    return scene ? scene->camera : scene::Camera();
}

/// Where the camera is in the world, and where it looks.
void expect_same_view(const scene::Camera& a, const scene::Camera& b) {
    const Vec3d from = position_of(a) + a.world_position, to = position_of(b) + b.world_position;
    EXPECT_NEAR((from - to).length(), 0, 1e-9);
    EXPECT_NEAR((forward_of(a) - forward_of(b)).length(), 0, 1e-12);
    EXPECT_NEAR((up_of(a) - up_of(b)).length(), 0, 1e-12);
}

TEST(CameraEdits, AreOpinionsOverTheCameraOfTheScene) {
    const test::Workplace w;
    // Only a lens with an aperture has a focus
    std::string scene = test::small_scene();
    const std::string focal_length = "float focalLength = 20";
    ASSERT_NE(scene.find(focal_length), std::string::npos);
    scene.replace(scene.find(focal_length), focal_length.size(),
                  focal_length + "\nfloat fStop = 2");
    w.write("scene.usda", scene);
    const scene::Camera first = camera_of(w.path("scene.usda"));
    scene::Camera edited = orbit(first, Vec3d(0, -1, -4), {0, 1, 0}, 33, 12);
    edited.focus_distance = 3.5;
    ASSERT_TRUE(save_edits(w.path("look.usda"), {camera_edit(first, edited)}).has_value());
    w.write("edited.usda",
            "#usda 1.0\n(\n    defaultPrim = \"W\"\n    subLayers = [@look.usda@, "
            "@scene.usda@]\n)\n");
    const scene::Camera read = camera_of(w.path("edited.usda"));
    expect_same_view(read, edited);
    EXPECT_NEAR(read.focus_distance, 3.5, 1e-6);
    EXPECT_EQ(read.window_right, first.window_right) << "the lens is that of the scene";
    // As the command takes them
    const test::CommandResult r =
        w.velatura("render scene.usda --session look.usda -o a.exr --res 32 24 --spp 4 -q");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    const test::CommandResult same =
        w.velatura("render edited.usda -o b.exr --res 32 24 --spp 4 -q");
    EXPECT_EQ(same.exit_code, 0) << same.output;
    EXPECT_EQ(w.hash("a.exr"), w.hash("b.exr"));
}

TEST(CameraEdits, ASceneWithoutACameraGetsOne) {
    const test::Workplace w;
    w.write("scene.usda", R"(#usda 1.0
def Sphere "Ball"
{
    double radius = 2
}
def DistantLight "Sun"
{
}
)");
    const scene::Camera first = camera_of(w.path("scene.usda"));
    const scene::Camera edited = orbit(first, -first.world_position, {0, 1, 0}, 45, 0);
    ASSERT_TRUE(save_edits(w.path("look.usda"), {camera_edit(first, edited)}).has_value());
    w.write("edited.usda", "#usda 1.0\n(\n    subLayers = [@look.usda@, @scene.usda@]\n)\n");
    const scene::Camera read = camera_of(w.path("edited.usda"));
    expect_same_view(read, edited);
    EXPECT_NEAR(read.window_right, edited.window_right, 1e-6);
    EXPECT_NEAR(read.window_top, edited.window_top, 1e-6);
}

TEST(CameraEdits, AreSavedAsUsda) {
    const auto saved = save_edits("look.exr", {});
    ASSERT_FALSE(saved.has_value());
    EXPECT_EQ(saved.error().code, "bad-output");
}

}  // namespace
}  // namespace velatura::view
