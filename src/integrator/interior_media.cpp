// SPDX-License-Identifier: Apache-2.0
#include "integrator/interior_media.h"

#include <variant>

namespace velatura::integrator {

InteriorMedia::InteriorMedia(const scene::Scene& scene)
    : media_(scene.materials.size()), is_placed_(scene.materials.size()) {
    for (size_t m = 0; m < scene.materials.size(); ++m) {
        const scene::MediumProperties inside = scene::medium_properties_inside(scene.materials[m]);
        if (!is_black(inside.scattering)) media_[m] = Medium{media::HomogeneousMedium(inside)};
    }
    const auto place_shape = [&](const scene::Shape& shape, scene::LinkClass link) {
        place(shape.material, shape.provenance, link);
        if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry))
            for (const scene::MaterialId m : mesh->face_materials) place(m, shape.provenance, link);
    };
    for (const scene::Shape& shape : scene.shapes) place_shape(shape, shape.link);
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const scene::Instance& instance = scene.instances[i];
        const std::vector<scene::Shape>& shapes = scene.prototypes[instance.prototype].shapes;
        for (uint32_t s = 0; s < shapes.size(); ++s) {
            const scene::LinkClass link = scene::link_class(scene, i, s);
            place(instance.material_override, shapes[s].provenance, link);
            place_shape(shapes[s], link);
        }
    }
}

void InteriorMedia::place(scene::MaterialId material,
                          scene::ProvenanceId provenance,
                          scene::LinkClass link) {
    if (material >= media_.size() || !media_[material] || is_placed_[material]) return;
    is_placed_[material] = true;
    media_[material]->provenance = provenance;
    media_[material]->link = link;
}

}  // namespace velatura::integrator
