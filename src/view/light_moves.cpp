// SPDX-License-Identifier: Apache-2.0
#include "view/light_moves.h"

#include <cmath>
#include <numbers>

namespace velatura::view {

std::optional<std::array<double, 2>> pixel_of(const scene::Camera& camera,
                                              const image::Window& frame,
                                              const Vec3d& point) {
    Vec3d seen;
    camera.render_from_camera.inverse().multVecMatrix(point, seen);
    const bool is_orthographic = camera.projection == scene::Camera::Projection::Orthographic;
    const double depth = is_orthographic ? 1 : -seen[2];
    if (!(depth > 0)) return std::nullopt;
    const double x = (seen[0] / depth - camera.window_left) /
                     (camera.window_right - camera.window_left),
                 y = (camera.window_top - seen[1] / depth) /
                     (camera.window_top - camera.window_bottom);
    return std::array<double, 2>{x * frame.width(), y * frame.height()};
}

double distance_along(const scene::Camera& camera,
                      const image::Window& frame,
                      const Vec3d& from,
                      const Vec3d& axis,
                      const std::array<double, 2>& moved) {
    const Vec3d eye(camera.render_from_camera[3][0], camera.render_from_camera[3][1],
                    camera.render_from_camera[3][2]);
    // Small beside the distance, so that perspective does not bend it
    const double step = 1e-4 * std::max((from - eye).length(), 1e-6);
    const auto a = pixel_of(camera, frame, from), b = pixel_of(camera, frame, from + step * axis);
    if (!a || !b) return 0;
    const double dx = ((*b)[0] - (*a)[0]) / step, dy = ((*b)[1] - (*a)[1]) / step;
    const double square = dx * dx + dy * dy;
    // An axis that points at the camera would take the light to infinity
    const double pixels_across = frame.width() / (from - eye).length();
    if (square < 1e-4 * pixels_across * pixels_across) return 0;
    return (dx * moved[0] + dy * moved[1]) / square;
}

Mat4d moved_by(const Mat4d& m, const Vec3d& offset) {
    Mat4d moved = m;
    for (int i = 0; i < 3; ++i) moved[3][i] += offset[i];
    return moved;
}

Mat4d turned_by(const Mat4d& m, const Vec3d& axis, double degrees) {
    Mat4d turn;
    turn.setAxisAngle(axis.normalized(), degrees * std::numbers::pi / 180);
    Mat4d turned = m;
    for (int i = 0; i < 3; ++i) turned[3][i] = 0;
    turned = turned * turn;
    for (int i = 0; i < 3; ++i) turned[3][i] = m[3][i];
    return turned;
}

std::array<Vec3d, 3> axes_of(const Mat4d& m) {
    std::array<Vec3d, 3> axes = {Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
    for (int i = 0; i < 3; ++i) {
        const Vec3d axis(m[i][0], m[i][1], m[i][2]);
        if (axis.length() > 0) axes[size_t(i)] = axis.normalized();
    }
    return axes;
}

Vec3d origin_of(const Mat4d& m) {
    return {m[3][0], m[3][1], m[3][2]};
}

}  // namespace velatura::view
