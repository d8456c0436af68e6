// SPDX-License-Identifier: Apache-2.0
#include "integrator/effect_rules.h"

#include <fmt/format.h>

#include <array>

namespace velatura::integrator {

using scene::Effect;

namespace {

void find_lens(EffectFindings& found) {
    const scene::Camera& c = found.scene.camera;
    if (!(c.lens_radius > 0 && c.focus_distance > 0)) return;
    const std::string blades =
        c.lens_blades > 0 ? fmt::format(" with {} blades", c.lens_blades) : "";
    found.on(c.name, fmt::format("lens of radius {:g}{} focused at {:g}", c.lens_radius, blades,
                                 c.focus_distance));
}

void close_lens(scene::Scene& scene) {
    scene.camera.lens_radius = 0;
}

void find_moving_camera(EffectFindings& found) {
    const scene::Camera& c = found.scene.camera;
    if (!c.motion_keys.empty())
        found.on(c.name,
                 fmt::format("{} segments while the shutter is open", c.motion_keys.size() - 1));
}

void stop_camera(scene::Scene& scene) {
    scene.camera.motion_keys.clear();
}

void find_moving_transforms(EffectFindings& found) {
    const auto note = [&](scene::ProvenanceId provenance, size_t segments) {
        if (segments > 0)
            found.on(found.prim_of(provenance),
                     fmt::format("{} segments while the shutter is open", segments));
    };
    for (const scene::Instance& i : found.scene.instances)
        note(i.provenance, i.later_render_from_prototype.size());
    for (const scene::Light& light : found.scene.lights)
        note(light.provenance, light.later_render_from_light.size());
    for (const scene::Volume& volume : found.scene.volumes)
        note(volume.provenance, volume.later_render_from_volume.size());
}

void stop_transforms(scene::Scene& scene) {
    for (scene::Instance& i : scene.instances) i.later_render_from_prototype.clear();
    for (scene::Light& light : scene.lights) light.later_render_from_light.clear();
    for (scene::Volume& volume : scene.volumes) volume.later_render_from_volume.clear();
}

void find_moving_meshes(EffectFindings& found) {
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
        if (mesh && !mesh->later_points.empty())
            found.on(
                found.prim_of(shape.provenance),
                fmt::format("{} segments while the shutter is open", mesh->later_points.size()));
    });
}

void stop_meshes(scene::Scene& scene) {
    for (scene::MeshLight& light : scene.mesh_lights) light.later_parent_from_light.clear();
    const auto stop = [](scene::Shape& shape) {
        if (auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) {
            mesh->later_points.clear();
            mesh->later_normals.clear();
        }
    };
    for (scene::Shape& shape : scene.shapes) stop(shape);
    for (scene::Prototype& prototype : scene.prototypes)
        for (scene::Shape& shape : prototype.shapes) stop(shape);
}

constexpr std::array rules = {
    EffectRule{Effect::DepthOfField, find_lens, close_lens, true},
    EffectRule{Effect::CameraBlur, find_moving_camera, stop_camera},
    EffectRule{Effect::TransformBlur, find_moving_transforms, stop_transforms},
    EffectRule{Effect::DeformationBlur, find_moving_meshes, stop_meshes, true},
};

}  // namespace

std::span<const EffectRule> camera_rules() {
    return rules;
}

}  // namespace velatura::integrator
