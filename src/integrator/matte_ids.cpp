// SPDX-License-Identifier: Apache-2.0
#include "integrator/matte_ids.h"

#include "layers/cryptomatte.h"

#include <set>
#include <string>
#include <vector>

namespace velatura::integrator {

MatteIds::MatteIds(const scene::Scene& scene)
    : scene_(scene), without_name_(layers::matte_id(no_name)) {
    for (const scene::Provenance& p : scene.provenance)
        of_provenance_.push_back(layers::matte_id(p.prim_path));
    for (const scene::Material& m : scene.materials)
        of_material_.push_back(layers::matte_id(m.name));
    for (const std::string& name : scene.assets) of_asset_.push_back(layers::matte_id(name));
}

layers::MatteNames MatteIds::names() const {
    // Many instances come from one prim
    std::vector<bool> is_seen(scene_.provenance.size(), false);
    std::set<std::string> objects, materials = {no_name}, assets = {no_name};
    const auto add = [&](scene::ProvenanceId id) {
        if (id >= is_seen.size() || is_seen[id]) return;
        is_seen[id] = true;
        objects.insert(scene_.provenance[id].prim_path);
    };
    scene::for_each_shape(scene_, [&](const scene::Shape& shape) { add(shape.provenance); });
    for (const scene::Instance& i : scene_.instances) add(i.provenance);
    for (const scene::Material& m : scene_.materials) materials.insert(m.name);
    assets.insert(scene_.assets.begin(), scene_.assets.end());
    layers::MatteNames names;
    names[size_t(accumulate::MatteKind::Asset)].assign(assets.begin(), assets.end());
    names[size_t(accumulate::MatteKind::Object)].assign(objects.begin(), objects.end());
    names[size_t(accumulate::MatteKind::Material)].assign(materials.begin(), materials.end());
    return names;
}

}  // namespace velatura::integrator
