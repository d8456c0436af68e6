// SPDX-License-Identifier: Apache-2.0
#include "geometry/shape_list.h"

namespace velatura::geometry {

namespace {

/// Whether light is sampled from the shape.
bool is_light(const scene::Scene& scene, const scene::Shape& shape) {
    if (shape.light != scene::none) return true;
    return shape.material < scene.materials.size() &&
           scene::is_emissive(scene.materials[shape.material]);
}

/// [prototype] whether some instance gives it a material that emits.
std::vector<bool> made_to_glow(const scene::Scene& scene) {
    std::vector<bool> glows(scene.prototypes.size());
    for (const scene::Instance& instance : scene.instances) {
        const scene::MaterialId material = instance.material_override;
        if (material < scene.materials.size() && scene::is_emissive(scene.materials[material]))
            glows[instance.prototype] = true;
    }
    return glows;
}

}  // namespace

std::vector<ListedShape> list_shapes(const scene::Scene& scene) {
    std::vector<ListedShape> list;
    for (size_t i = 0; i < scene.shapes.size(); ++i)
        list.push_back({&scene.shapes[i], scene::none, i, is_light(scene, scene.shapes[i])});
    const std::vector<bool> glows = made_to_glow(scene);
    for (size_t p = 0; p < scene.prototypes.size(); ++p) {
        const std::vector<scene::Shape>& shapes = scene.prototypes[p].shapes;
        for (size_t i = 0; i < shapes.size(); ++i)
            list.push_back({&shapes[i], uint32_t(p), i, glows[p] || is_light(scene, shapes[i])});
    }
    return list;
}

}  // namespace velatura::geometry
