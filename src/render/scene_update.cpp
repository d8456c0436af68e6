// SPDX-License-Identifier: Apache-2.0
#include "render/scene_update.h"

#include "render/scene_compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

namespace velatura::render {

namespace {

/// Whether meshes are cut as finely as the camera's image needs.
bool depends_on_view(const scene::Scene& scene) {
    if (std::any_of(scene.materials.begin(), scene.materials.end(), scene::is_displacing))
        return true;
    bool is_any = false;
    scene::for_each_shape(scene, [&](const scene::Shape& shape) {
        const auto* const mesh = std::get_if<scene::Mesh>(&shape.geometry);
        is_any = is_any || (mesh && mesh->subdivision != scene::SubdivisionScheme::None);
    });
    return is_any;
}

/// Whether set_instance() leads from one to the other.
bool differs_by_place(const scene::Instance& a, const scene::Instance& b) {
    scene::Instance moved = a;
    moved.render_from_prototype = b.render_from_prototype;
    moved.later_render_from_prototype.clear();
    return is_same(moved, b);
}

/// What no edit reaches; null: nothing.
const char* reason_to_replace(const scene::Scene& from,
                              const scene::Scene& to,
                              const UpdateOptions& options) {
    if (const char* const what = fixed_difference(from, to)) return what;
    for (size_t i = 0; i < to.lights.size(); ++i)
        if (from.lights[i].group != to.lights[i].group) return "groups of lights";
    for (size_t i = 0; i < to.instances.size(); ++i)
        if (!is_same(from.instances[i], to.instances[i]) &&
            !differs_by_place(from.instances[i], to.instances[i]))
            return "instances";
    const bool is_view_same = is_same(from.camera, to.camera) &&
                              from.settings.width == to.settings.width &&
                              from.settings.height == to.settings.height;
    if (!is_view_same && !options.keeps_dicing && depends_on_view(to))
        return "dicing for another camera";
    return nullptr;
}

void replace(Renderer& renderer, scene::Scene&& scene) {
    Settings settings = renderer.settings();
    if (!settings.layers.groups.empty()) {
        settings.layers.groups.clear();
        settings.layers.casters.clear();
        settings.layers = with_rows(std::move(settings.layers), scene);
    }
    renderer = Renderer(std::move(scene), std::move(settings));
}

/// Calls apply(index) for the elements that differ. Returns: how many.
template <class T, class Apply>
size_t apply_differences(const std::vector<T>& from, const std::vector<T>& to, const Apply& apply) {
    size_t count = 0;
    for (size_t i = 0; i < to.size(); ++i) {
        if (is_same(from[i], to[i])) continue;
        apply(i);
        ++count;
    }
    return count;
}

}  // namespace

std::string UpdateReport::text() const {
    if (is_replaced) return "scene replaced: " + why;
    if (is_unchanged()) return "unchanged";
    std::vector<std::string> parts;
    if (camera) parts.emplace_back("camera");
    const auto add = [&parts](size_t count, const char* what) {
        if (count > 0) parts.push_back(fmt::format("{} {}{}", count, what, count == 1 ? "" : "s"));
    };
    add(lights, "light");
    add(materials, "material");
    add(instances, "instance");
    add(shapes, "shape");
    return fmt::format("{} edited", fmt::join(parts, ", "));
}

UpdateReport update(Renderer& renderer, scene::Scene&& scene, const UpdateOptions& options) {
    if (!renderer.settings().omitted.is_empty()) plan_effects(renderer.settings(), scene);
    UpdateReport report;
    const scene::Scene& old = renderer.scene();
    if (const char* const why = reason_to_replace(old, scene, options)) {
        report.is_replaced = true;
        report.why = why;
        replace(renderer, std::move(scene));
        return report;
    }
    if (old.settings.width != scene.settings.width ||
        old.settings.height != scene.settings.height) {
        renderer.set_size(scene.settings.width, scene.settings.height, renderer.settings().window);
        report.camera = true;
    }
    if (!is_same(old.camera, scene.camera)) {
        renderer.set_camera(scene.camera);
        report.camera = true;
    }
    report.lights = apply_differences(old.lights, scene.lights,
                                      [&](size_t i) { renderer.set_light(i, scene.lights[i]); });
    report.materials = apply_differences(old.materials, scene.materials, [&](size_t i) {
        renderer.set_material(scene::MaterialId(i), scene.materials[i]);
    });
    report.instances = apply_differences(old.instances, scene.instances, [&](size_t i) {
        renderer.set_instance(i, scene.instances[i].render_from_prototype);
    });
    report.shapes = apply_differences(old.shapes, scene.shapes,
                                      [&](size_t i) { renderer.set_shape(i, scene.shapes[i]); });
    return report;
}

scene::Camera rebased(const scene::Camera& camera, const Vec3d& origin) {
    scene::Camera moved = camera;
    const Vec3d offset = camera.world_position - origin;
    const auto move = [&](Mat4d& matrix) {
        for (int i = 0; i < 3; ++i) matrix[3][i] += offset[i];
    };
    move(moved.render_from_camera);
    for (Mat4d& key : moved.motion_keys) move(key);
    moved.world_position = origin;
    return moved;
}

}  // namespace velatura::render
