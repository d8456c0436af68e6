// SPDX-License-Identifier: Apache-2.0
#include "scene/scene.h"

#include <algorithm>

namespace velatura::scene {

PrimvarId find_primvar(const Scene& scene, std::string_view name) {
    const auto it = std::find(scene.primvar_names.begin(), scene.primvar_names.end(), name);
    return it == scene.primvar_names.end() ? none : PrimvarId(it - scene.primvar_names.begin());
}

const Primvar* find_primvar(const Shape& shape, PrimvarId name) {
    const std::vector<Primvar>& primvars = std::visit(
        [](const auto& g) -> const std::vector<Primvar>& { return g.primvars; }, shape.geometry);
    const auto it = std::find_if(primvars.begin(), primvars.end(),
                                 [&](const Primvar& p) { return p.name == name; });
    return it == primvars.end() ? nullptr : &*it;
}

bool shows_display_color(const Shape& shape) {
    const auto* mesh = std::get_if<Mesh>(&shape.geometry);
    if (!mesh || mesh->face_materials.empty()) return shape.material == none;
    return std::find(mesh->face_materials.begin(), mesh->face_materials.end(), none) !=
           mesh->face_materials.end();
}

bool can_cut_display(const Scene& scene) {
    const PrimvarId name = find_primvar(scene, display_opacity_primvar);
    if (name == none) return false;
    bool is_found = false;
    // Which instances bring one along is not worth a search: some shape shows it
    const bool is_handed_down =
        std::any_of(scene.instance_values.begin(), scene.instance_values.end(),
                    [&](const auto& v) { return v.name == name && !(v.values[0] >= 1.0f); });
    for_each_shape(scene, [&](const Shape& shape) {
        if (is_found || !shows_display_color(shape)) return;
        is_found = is_handed_down;
        if (is_found) return;
        const Primvar* opacity = find_primvar(shape, name);
        is_found = opacity && std::any_of(opacity->values.begin(), opacity->values.end(),
                                          [](float v) { return !(v >= 1.0f); });
    });
    return is_found;
}

LinkClass link_class(const Scene& scene, uint32_t instance, ShapeId shape) {
    if (instance == none) return scene.shapes[shape].link;
    const uint32_t row = scene.instances[instance].link_row;
    return row == none ? 0 : scene.linking.rows[row][shape];
}

LightLinks plain_links(const Scene& scene) {
    LightLinks links;
    links.casters = scene.linking.visible_to(RayKind::Shadow);
    return links;
}

bool has_plain_shadows(const Scene& scene, const LightLinks& links) {
    LightLinks shadows = links;
    shadows.lit = none;
    return shadows == plain_links(scene);
}

bool has_shadow_links(const Scene& scene, const LightLinks& links) {
    const LinkSet* casters = find_link_set(scene, links.casters);
    return casters && !casters->is_empty() &&
           links.casters != scene.linking.visible_to(RayKind::Shadow);
}

bool has_shadow_controls(const Scene& scene, const LightLinks& links) {
    LightLinks by_all = links;
    by_all.casters = none;
    return by_all.has_custom_shadows() ||
           (links.casters != plain_links(scene).casters && !has_shadow_links(scene, links));
}

bool asks_for_classes(const Scene& scene) {
    if (scene.linking.has_ray_visibility()) return true;
    return std::any_of(scene.lights.begin(), scene.lights.end(),
                       [&](const Light& light) { return has_shadow_links(scene, light.links); }) ||
           std::any_of(scene.mesh_lights.begin(), scene.mesh_lights.end(),
                       [](const MeshLight& light) { return light.links.casters != none; });
}

const InstanceValue* find_value(const Scene& scene, const Instance& instance, PrimvarId name) {
    for (const InstanceValue& value : values_of(scene, instance))
        if (value.name == name) return &value;
    return nullptr;
}

void set_value(Scene& scene, Instance& instance, const InstanceValue& value) {
    std::vector<InstanceValue> values;
    for (const InstanceValue& old : values_of(scene, instance))
        if (old.name != value.name) values.push_back(old);
    values.push_back(value);
    std::ranges::sort(values, {}, &InstanceValue::name);
    instance.first_value = uint32_t(scene.instance_values.size());
    instance.value_count = uint32_t(values.size());
    scene.instance_values.insert(scene.instance_values.end(), values.begin(), values.end());
}

bool reads_primvar(const Scene& scene, const Input& input, PrimvarId name) {
    const auto is_at = [&](TextureId texture) {
        return texture < scene.textures.size() && scene.textures[texture].st == name;
    };
    switch (input.source) {
        case Input::Source::Constant:
            return false;
        case Input::Source::Primvar:
            return input.primvar == name;
        case Input::Source::Texture:
            return is_at(input.texture);
        case Input::Source::Pattern:
            break;
    }
    const std::vector<PatternStep>& steps = scene.patterns[input.pattern].steps;
    return std::any_of(steps.begin(), steps.end(), [&](const PatternStep& step) {
        return (step.op == PatternOp::Primvar && step.data == name) ||
               (step.op == PatternOp::Texture && is_at(step.data));
    });
}

PrimvarId intern_primvar(Scene& scene, std::string_view name) {
    const PrimvarId found = find_primvar(scene, name);
    if (found != none) return found;
    scene.primvar_names.emplace_back(name);
    return PrimvarId(scene.primvar_names.size() - 1);
}

}  // namespace velatura::scene
