// SPDX-License-Identifier: Apache-2.0
#include "view/camera_moves.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::view {
namespace {

/// At (0, 0, 5), looking at the origin along −Z.
scene::Camera camera_before_origin() {
    scene::Camera c;
    c.render_from_camera.setTranslation(Vec3d(0, 0, 5));
    return c;
}

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance = 1e-12) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(CameraMoves, AnOrbitTurnsAboutThePivot) {
    const Vec3d up(0, 1, 0), origin(0.0);
    // Dragged to the right the scene turns to the right: the camera goes to the left
    const scene::Camera left = orbit(camera_before_origin(), origin, up, 90, 0);
    expect_near(position_of(left), {-5, 0, 0});
    expect_near(forward_of(left), {1, 0, 0});
    expect_near(up_of(left), up);
    // Dragged down it shows its top: the camera rises
    const scene::Camera above = orbit(camera_before_origin(), origin, up, 0, 60);
    expect_near(position_of(above), {0, 5 * std::sin(pi_d / 3), 2.5});
    expect_near(forward_of(above), (-position_of(above)).normalized());
    // About any pivot the distance to it stays
    const Vec3d pivot(1, 2, -3);
    const scene::Camera c = orbit(camera_before_origin(), pivot, up, 31, -17);
    EXPECT_NEAR((position_of(c) - pivot).length(), (Vec3d(0, 0, 5) - pivot).length(), 1e-12);
    EXPECT_NEAR(right_of(c).dot(up), 0, 1e-12) << "the horizon is level";
}

TEST(CameraMoves, AnOrbitStopsShortOfThePoles) {
    const Vec3d up(0, 1, 0);
    scene::Camera c = camera_before_origin();
    for (int i = 0; i < 50; ++i) c = orbit(c, Vec3d(0.0), up, 7, 20);
    EXPECT_NEAR(forward_of(c).dot(up), -std::sin(89 * pi_d / 180), 1e-9);
    EXPECT_GT(up_of(c).dot(up), 0);
    for (int i = 0; i < 50; ++i) c = orbit(c, Vec3d(0.0), up, 0, -20);
    EXPECT_NEAR(forward_of(c).dot(up), std::sin(89 * pi_d / 180), 1e-9);
    EXPECT_GT(up_of(c).dot(up), 0);
}

TEST(CameraMoves, APanKeepsTheView) {
    const scene::Camera turned = orbit(camera_before_origin(), Vec3d(0.0), {0, 1, 0}, 40, 20);
    const scene::Camera c = pan(turned, 2, -1);
    expect_near(forward_of(c), forward_of(turned));
    expect_near(position_of(c) - position_of(turned), 2.0 * right_of(turned) - up_of(turned));
}

TEST(CameraMoves, ADollyScalesTheDistance) {
    const Vec3d pivot(1, 0, 0);
    const scene::Camera c = dolly(camera_before_origin(), pivot, 0.25);
    expect_near(position_of(c), pivot + 0.25 * (Vec3d(0, 0, 5) - pivot));
    scene::Camera flat = camera_before_origin();
    flat.projection = scene::Camera::Projection::Orthographic;
    flat = dolly(flat, pivot, 2);
    expect_near(position_of(flat), {0, 0, 5});
    EXPECT_EQ(flat.window_right, 2);
    EXPECT_EQ(flat.window_bottom, -2);
    // What is no factor leaves it where it is
    expect_near(position_of(dolly(c, pivot, 0)), position_of(c));
}

TEST(CameraMoves, AFramedBoxFillsTheImage) {
    scene::Camera c = orbit(camera_before_origin(), Vec3d(0.0), {0, 1, 0}, 25, 10);
    c.window_top = 0.5;
    c.window_bottom = -0.5;
    const Box3d box(Vec3d(10, 20, 30), Vec3d(12, 21, 33));
    const Vec3d middle(11, 20.5, 31.5);
    const scene::Camera f = frame(c, box);
    expect_near(forward_of(f), forward_of(c));
    expect_near((middle - position_of(f)).normalized(), forward_of(f), 1e-9);
    // Its sphere touches the upper edge of the image: the angle is that of the window
    const double radius = 0.5 * (box.max - box.min).length();
    EXPECT_NEAR(radius / (middle - position_of(f)).length(), std::sin(std::atan(0.5)), 1e-12);
    expect_near(position_of(frame(c, Box3d())), position_of(c));
}

TEST(CameraMoves, KeysOfACameraThatMovesGoAlong) {
    scene::Camera c = camera_before_origin();
    Mat4d later;
    later.setTranslation(Vec3d(0, 0, 4));
    c.motion_keys = {c.render_from_camera, later};
    const scene::Camera moved = pan(c, 1, 0);
    ASSERT_EQ(moved.motion_keys.size(), 2u);
    EXPECT_EQ(moved.motion_keys[1][3][0], 1);
    EXPECT_EQ(moved.motion_keys[1][3][2], 4);
}

TEST(CameraMoves, TheSceneStandsOnYOrZ) {
    scene::Camera c = camera_before_origin();
    expect_near(nearest_up(c), {0, 1, 0});
    // Z up: looking along +Y
    c.render_from_camera = Mat4d(1, 0, 0, 0, 0, 0.2, 1, 0, 0, -1, 0.2, 0, 0, 0, 0, 1);
    expect_near(nearest_up(c), {0, 0, 1});
}

}  // namespace
}  // namespace velatura::view
