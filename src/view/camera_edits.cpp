// SPDX-License-Identifier: Apache-2.0
#include "view/camera_edits.h"

#include "base/atomic_file.h"
#include "base/math.h"

#include <fmt/format.h>

#include <vector>

namespace velatura::view {

namespace {

/// Camera to world, in USD's notation of a matrix.
std::string world_matrix(const scene::Camera& camera) {
    Mat4d m = camera.render_from_camera;
    for (int i = 0; i < 3; ++i) m[3][i] += camera.world_position[i];
    std::string text = "(";
    for (int row = 0; row < 4; ++row)
        text += fmt::format("{} ({}, {}, {}, {})", row == 0 ? "" : ",", m[row][0], m[row][1],
                            m[row][2], m[row][3]);
    return text + " )";
}

std::vector<std::string> names_in(const std::string& path) {
    std::vector<std::string> names;
    size_t at = 1;
    while (at < path.size()) {
        const size_t end = std::min(path.find('/', at), path.size());
        names.push_back(path.substr(at, end - at));
        at = end + 1;
    }
    return names;
}

/// A camera of its own: focal length and apertures for the image window at distance 1.
std::string lens(const scene::Camera& c) {
    const bool is_orthographic = c.projection == scene::Camera::Projection::Orthographic;
    // Tenths of a scene unit
    constexpr double focal_length = 50;
    const double unit = is_orthographic ? 10 : focal_length;
    std::string text = fmt::format(
        "float horizontalAperture = {}\nfloat verticalAperture = {}\n"
        "float horizontalApertureOffset = {}\nfloat verticalApertureOffset = {}\n",
        unit * (c.window_right - c.window_left), unit * (c.window_top - c.window_bottom),
        unit * 0.5 * (c.window_right + c.window_left),
        unit * 0.5 * (c.window_top + c.window_bottom));
    text += is_orthographic ? std::string("token projection = \"orthographic\"\n")
                            : fmt::format("float focalLength = {}\n", focal_length);
    return text;
}

}  // namespace

bool is_same_camera(const scene::Camera& a, const scene::Camera& b) {
    return a.render_from_camera == b.render_from_camera && a.motion_keys == b.motion_keys &&
           a.focus_distance == b.focus_distance && a.window_left == b.window_left &&
           a.window_right == b.window_right && a.window_bottom == b.window_bottom &&
           a.window_top == b.window_top;
}

std::string camera_edit(const scene::Camera& of_scene, const scene::Camera& edited) {
    const bool has_prim = edited.name.size() > 1 && edited.name[0] == '/';
    std::vector<std::string> names =
        has_prim ? names_in(edited.name) : std::vector<std::string>{"view_camera"};
    const bool has_window = of_scene.window_left != edited.window_left ||
                            of_scene.window_right != edited.window_right ||
                            of_scene.window_bottom != edited.window_bottom ||
                            of_scene.window_top != edited.window_top;
    std::string body = fmt::format(
        "matrix4d xformOp:transform:view = {}\n"
        "uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:transform:view\"]\n",
        world_matrix(edited));
    if (edited.focus_distance != of_scene.focus_distance)
        body += fmt::format("float focusDistance = {}\n", edited.focus_distance);
    if (!has_prim || has_window) body += lens(edited);
    std::string text = "#usda 1.0\n", indent;
    for (size_t i = 0; i < names.size(); ++i) {
        const bool is_camera = i + 1 == names.size();
        text += fmt::format("{}{} \"{}\"\n{}{{\n", indent,
                            is_camera && !has_prim ? "def Camera" : "over", names[i], indent);
        indent += "    ";
    }
    for (size_t at = 0; at < body.size();) {
        const size_t end = body.find('\n', at) + 1;
        text += indent + body.substr(at, end - at);
        at = end;
    }
    while (!indent.empty()) {
        indent.resize(indent.size() - 4);
        text += indent + "}\n";
    }
    return text;
}

Result<void> save_camera_edit(const std::string& path,
                              const scene::Camera& of_scene,
                              const scene::Camera& edited) {
    if (!path.ends_with(".usda")) return Error{"bad-output", path + ": edits are saved as .usda"};
    return write_file_atomically(path, camera_edit(of_scene, edited));
}

}  // namespace velatura::view
