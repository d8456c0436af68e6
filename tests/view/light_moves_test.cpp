// SPDX-License-Identifier: Apache-2.0
#include "view/light_moves.h"

#include "camera/camera_model.h"
#include "view/camera_moves.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::view {
namespace {

constexpr image::Window frame = {0, 0, 96, 64};

scene::Camera camera_at_random(scene::Camera::Projection projection) {
    scene::Camera camera;
    camera.projection = projection;
    camera.window_left = -0.7;
    camera.window_right = 0.5;
    camera.window_bottom = -0.3;
    camera.window_top = 0.45;
    camera.clip_near = 0.01;
    camera.clip_far = 1e6;
    return pan(orbit(camera, Vec3d(0.3, -1, -5), {0, 1, 0}, 40, 20), 0.2, -0.1);
}

class LightMoves : public testing::TestWithParam<scene::Camera::Projection> {};

/// The camera's own rays are the oracle: what lies on the ray of a pixel is seen there.
TEST_P(LightMoves, APointIsSeenWhereItsRayIs) {
    const scene::Camera camera = camera_at_random(GetParam());
    const camera::CameraModel rays(camera, frame.width(), frame.height());
    for (const float x : {3.5f, 48.0f, 90.25f}) {
        for (const float y : {1.0f, 30.5f, 63.0f}) {
            const camera::CameraRay ray = rays.generate_ray({x, y}, {0.5f, 0.5f});
            const Vec3d point = Vec3d(ray.o) + 7.0 * Vec3d(ray.d);
            const auto pixel = pixel_of(camera, frame, point);
            ASSERT_TRUE(pixel);
            EXPECT_NEAR((*pixel)[0], double(x), 1e-3);
            EXPECT_NEAR((*pixel)[1], double(y), 1e-3);
        }
    }
    const Vec3d behind = position_of(camera) - 2.0 * forward_of(camera);
    EXPECT_EQ(pixel_of(camera, frame, behind).has_value(),
              GetParam() == scene::Camera::Projection::Orthographic);
}

TEST_P(LightMoves, APointFollowsTheMouseAlongItsAxis) {
    const scene::Camera camera = camera_at_random(GetParam());
    const Vec3d from(0.2, -0.8, -4.5);
    for (const Vec3d& axis : {right_of(camera), up_of(camera), Vec3d(0, 1, 0)}) {
        const auto before = pixel_of(camera, frame, from);
        const std::array<double, 2> moved = {0.02, -0.03};
        const double way = distance_along(camera, frame, from, axis, moved);
        const auto after = pixel_of(camera, frame, from + way * axis);
        ASSERT_TRUE(before && after);
        // As far along the axis' image as the mouse has gone in its direction
        const double dx = (*after)[0] - (*before)[0], dy = (*after)[1] - (*before)[1];
        const double length = std::hypot(dx, dy);
        ASSERT_GT(length, 0);
        EXPECT_NEAR(std::abs(dx * moved[0] + dy * moved[1]) / length, length, 1e-4);
    }
    // Seen from its end
    const Vec3d view = (from - position_of(camera)).normalized();
    const Vec3d end =
        GetParam() == scene::Camera::Projection::Orthographic ? forward_of(camera) : view;
    EXPECT_EQ(distance_along(camera, frame, from, end, {5, 5}), 0);
}

INSTANTIATE_TEST_SUITE_P(Projections,
                         LightMoves,
                         testing::Values(scene::Camera::Projection::Perspective,
                                         scene::Camera::Projection::Orthographic));

TEST(LightMatrices, MoveAndTurn) {
    Mat4d m;
    m.setTranslation(Vec3d(1, 2, 3));
    EXPECT_EQ(origin_of(moved_by(m, {0.5, 0, -1})), Vec3d(1.5, 2, 2));
    const Mat4d turned = turned_by(m, {0, 1, 0}, 90);
    EXPECT_EQ(origin_of(turned), Vec3d(1, 2, 3));
    // A quarter turn about y takes z to x
    EXPECT_NEAR((axes_of(turned)[2] - Vec3d(1, 0, 0)).length(), 0, 1e-12);
    EXPECT_NEAR((axes_of(turned)[0] - Vec3d(0, 0, -1)).length(), 0, 1e-12);
    EXPECT_NEAR((origin_of(turned_by(turned, {0, 1, 0}, -90)) - origin_of(m)).length(), 0, 1e-12);
}

}  // namespace
}  // namespace velatura::view
