// SPDX-License-Identifier: Apache-2.0
#include "scene/plate.h"

#include <map>
#include <utility>
#include <vector>

namespace velatura::scene {

namespace {

/// The shapes of a prototype that are catchers where an instance of a row places them.
struct PrototypePart {
    uint32_t prototype, link_row;  ///< of the plate
};

/// Takes over the catchers of instances, each prototype once for each row.
class InstanceTaker {
  public:
    InstanceTaker(const Scene& scene, const LinkSet& catchers, Scene& plate)
        : scene_(scene), catchers_(catchers), plate_(plate) {}

    void take(const Instance& instance) {
        const std::pair key(instance.prototype, instance.link_row);
        auto at = parts_.find(key);
        if (at == parts_.end()) at = parts_.emplace(key, make_part(instance)).first;
        if (at->second.prototype == none) return;
        Instance placed = instance;
        placed.prototype = at->second.prototype;
        placed.link_row = at->second.link_row;
        plate_.instances.push_back(std::move(placed));
    }

  private:
    PrototypePart make_part(const Instance& instance) {
        const Prototype& all = scene_.prototypes[instance.prototype];
        Prototype some;
        std::vector<LinkClass> row;
        for (size_t i = 0; i < all.shapes.size(); ++i) {
            const LinkClass c =
                instance.link_row == none ? 0 : scene_.linking.rows[instance.link_row][i];
            if (!catchers_.holds(c)) continue;
            some.shapes.push_back(all.shapes[i]);
            row.push_back(c);
        }
        if (row.empty()) return {none, none};
        some.name = all.name;
        plate_.prototypes.push_back(std::move(some));
        plate_.linking.rows.push_back(std::move(row));
        return {uint32_t(plate_.prototypes.size() - 1), uint32_t(plate_.linking.rows.size() - 1)};
    }

    const Scene& scene_;
    const LinkSet& catchers_;
    Scene& plate_;
    std::map<std::pair<uint32_t, uint32_t>, PrototypePart> parts_;
};

}  // namespace

Scene plate_of(const Scene& scene) {
    // Member by member: the geometry that is left out may be most of the memory. All are named
    // here, so that a new one is not forgotten
    const auto& [shapes, prototypes, instances, materials, textures, patterns, primvars, lights,
                 mesh_lights, volumes, volume_fields, linking, casters, groups, camera, settings,
                 provenance, assets, notes, moments, found_primvars, unit, rate, values] = scene;
    (void)prototypes, (void)volumes, (void)volume_fields, (void)casters, (void)notes;
    (void)moments, (void)found_primvars;
    Scene plate;
    plate.materials = materials;
    plate.textures = textures;
    plate.patterns = patterns;
    plate.primvar_names = primvars;
    plate.lights = lights;
    plate.mesh_lights = mesh_lights;
    plate.linking = linking;
    plate.linking.catchers = none;
    plate.groups = groups;
    plate.camera = camera;
    plate.settings = settings;
    plate.provenance = provenance;
    plate.assets = assets;
    plate.meters_per_unit = unit;
    plate.frames_per_second = rate;
    plate.instance_values = values;

    const LinkSet* const catchers = find_link_set(scene, scene.linking.catchers);
    if (!catchers) return plate;
    for (const Shape& shape : shapes)
        if (catchers->holds(shape.link)) plate.shapes.push_back(shape);
    InstanceTaker taker(scene, *catchers, plate);
    for (const Instance& instance : instances) taker.take(instance);
    return plate;
}

}  // namespace velatura::scene
