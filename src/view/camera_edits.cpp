// SPDX-License-Identifier: Apache-2.0
#include "view/camera_edits.h"

#include "base/math.h"
#include "view/value_edits.h"

#include <fmt/format.h>

#include <vector>

namespace velatura::view {

namespace {

/// Camera to world, in USD's notation of a matrix.
std::string world_matrix(const scene::Camera& camera) {
    Mat4d m = camera.render_from_camera;
    for (int i = 0; i < 3; ++i) m[3][i] += camera.world_position[i];
    return matrix_text(m);
}

bool has_same_window(const scene::Camera& a, const scene::Camera& b) {
    return a.window_left == b.window_left && a.window_right == b.window_right &&
           a.window_bottom == b.window_bottom && a.window_top == b.window_top;
}

bool is_orthographic(const scene::Camera& camera) {
    return camera.projection == scene::Camera::Projection::Orthographic;
}

/// A camera of its own: focal length and apertures for the image window at distance 1.
void add_lens(const scene::Camera& c, std::vector<std::string>& lines) {
    const bool is_ortho = is_orthographic(c);
    // Tenths of a scene unit
    constexpr double focal_length = 50;
    const double unit = is_ortho ? 10 : focal_length;
    const auto add = [&](const char* name, double value) {
        lines.push_back(fmt::format("float {} = {}", name, value));
    };
    add("horizontalAperture", unit * (c.window_right - c.window_left));
    add("verticalAperture", unit * (c.window_top - c.window_bottom));
    add("horizontalApertureOffset", unit * 0.5 * (c.window_right + c.window_left));
    add("verticalApertureOffset", unit * 0.5 * (c.window_top + c.window_bottom));
    if (is_ortho)
        lines.emplace_back("token projection = \"orthographic\"");
    else
        add("focalLength", focal_length);
}

}  // namespace

bool is_same_camera(const scene::Camera& a, const scene::Camera& b) {
    return a.render_from_camera == b.render_from_camera && a.motion_keys == b.motion_keys &&
           a.focus_distance == b.focus_distance && a.lens_radius == b.lens_radius &&
           has_same_window(a, b);
}

bool is_same_pose(const scene::Camera& a, const scene::Camera& b) {
    return a.render_from_camera == b.render_from_camera && a.motion_keys == b.motion_keys &&
           a.world_position == b.world_position && (!is_orthographic(a) || has_same_window(a, b));
}

scene::Camera with_pose(const scene::Camera& lens, const scene::Camera& pose) {
    scene::Camera camera = lens;
    camera.render_from_camera = pose.render_from_camera;
    camera.motion_keys = pose.motion_keys;
    if (is_orthographic(lens) && is_orthographic(pose)) {
        camera.window_left = pose.window_left;
        camera.window_right = pose.window_right;
        camera.window_bottom = pose.window_bottom;
        camera.window_top = pose.window_top;
    }
    return camera;
}

PrimEdit camera_edit(const scene::Camera& of_scene, const scene::Camera& edited) {
    const bool has_prim = edited.name.size() > 1 && edited.name[0] == '/';
    const bool has_other_window = is_orthographic(edited) && !has_same_window(of_scene, edited);
    PrimEdit edit{has_prim ? edited.name : "/view_camera", has_prim ? "" : "Camera", {}};
    edit.lines.push_back("matrix4d xformOp:transform:view = " + world_matrix(edited));
    edit.lines.emplace_back(
        "uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:transform:view\"]");
    if (edited.focus_distance != of_scene.focus_distance)
        edit.lines.push_back(fmt::format("float focusDistance = {}", edited.focus_distance));
    if (!has_prim || has_other_window) add_lens(edited, edit.lines);
    return edit;
}

}  // namespace velatura::view
