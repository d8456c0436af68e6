// SPDX-License-Identifier: Apache-2.0
#include "view/camera_moves.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::view {

namespace {

constexpr double degree = pi_d / 180;

Vec3d axis_of(const scene::Camera& camera, int row, double sign) {
    const Mat4d& m = camera.render_from_camera;
    return (sign * Vec3d(m[row][0], m[row][1], m[row][2])).normalized();
}

/// Moves the camera, and all its keys, as the space around it.
scene::Camera moved(scene::Camera camera, const Mat4d& by) {
    camera.render_from_camera = camera.render_from_camera * by;
    for (Mat4d& key : camera.motion_keys) key = key * by;
    return camera;
}

Mat4d translation(const Vec3d& by) {
    Mat4d m;
    m.setTranslation(by);
    return m;
}

Mat4d rotation(const Vec3d& axis, double degrees) {
    Mat4d m;
    m.setAxisAngle(axis, degrees * degree);
    return m;
}

}  // namespace

Vec3d position_of(const scene::Camera& camera) {
    const Mat4d& m = camera.render_from_camera;
    return {m[3][0], m[3][1], m[3][2]};
}

Vec3d right_of(const scene::Camera& camera) {
    return axis_of(camera, 0, 1);
}

Vec3d up_of(const scene::Camera& camera) {
    return axis_of(camera, 1, 1);
}

Vec3d forward_of(const scene::Camera& camera) {
    return axis_of(camera, 2, -1);
}

Vec3d nearest_up(const scene::Camera& camera) {
    const std::array<Vec3d, 4> axes = {Vec3d(0, 1, 0), Vec3d(0, 0, 1), Vec3d(0, -1, 0),
                                       Vec3d(0, 0, -1)};
    // Looking along an axis, the other one is up
    const Vec3d up = up_of(camera);
    return *std::max_element(axes.begin(), axes.end(),
                             [&](const Vec3d& a, const Vec3d& b) { return a.dot(up) < b.dot(up); });
}

scene::Camera orbit(
    const scene::Camera& camera, const Vec3d& pivot, const Vec3d& up, double yaw, double pitch) {
    constexpr double nearest_pole = 1;
    // Of the view above the horizon, which a pitch lowers
    const double height = std::asin(std::clamp(forward_of(camera).dot(up), -1.0, 1.0)) / degree;
    const double limit = std::max(90 - nearest_pole, std::abs(height));
    const double tilt = std::clamp(height - pitch, -limit, limit) - height;
    return moved(camera, translation(-pivot) * rotation(right_of(camera), tilt) *
                             rotation(up, -yaw) * translation(pivot));
}

scene::Camera pan(const scene::Camera& camera, double right, double up) {
    return moved(camera, translation(right * right_of(camera) + up * up_of(camera)));
}

scene::Camera dolly(const scene::Camera& camera, const Vec3d& pivot, double factor) {
    if (!(factor > 0)) return camera;
    if (camera.projection == scene::Camera::Projection::Orthographic) {
        scene::Camera scaled = camera;
        for (double* edge :
             {&scaled.window_left, &scaled.window_right, &scaled.window_bottom, &scaled.window_top})
            *edge *= factor;
        return scaled;
    }
    return moved(camera, translation((1 - factor) * (pivot - position_of(camera))));
}

scene::Camera frame(const scene::Camera& camera, const Box3d& box) {
    if (box.isEmpty()) return camera;
    const Vec3d middle = 0.5 * (box.min + box.max);
    const double radius = std::max(0.5 * (box.max - box.min).length(), 1e-9);
    const double half_width = 0.5 * (camera.window_right - camera.window_left),
                 half_height = 0.5 * (camera.window_top - camera.window_bottom);
    const double half = std::min(half_width, half_height);
    const Vec3d forward = forward_of(camera);
    if (camera.projection == scene::Camera::Projection::Orthographic) {
        const Vec3d aside = middle - position_of(camera);
        const scene::Camera centered =
            moved(camera, translation(aside - aside.dot(forward) * forward));
        return half > 0 ? dolly(centered, middle, radius / half) : centered;
    }
    // The sphere around the box touches the edges of the image
    const double distance = radius / std::sin(std::atan(std::max(half, 1e-6)));
    return moved(camera, translation(middle - distance * forward - position_of(camera)));
}

}  // namespace velatura::view
