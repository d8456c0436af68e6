// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"
#include "translate/context/instance_source.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

namespace velatura::translate::instancing {

/// Values of Scene::instance_values.
struct ValueRange {
    uint32_t first = 0, count = 0;
};

/// Adds the values to Scene::instance_values; those of the range before it serve again where they
/// are the same.
ValueRange add_values(scene::Scene& scene, const std::vector<scene::InstanceValue>& values);

/// Names of all primvars of the prim, those that it inherits included.
std::unordered_set<std::string> primvar_names(Prim prim);

/// What a PointInstancer hands down to its instances: constant and uniform primvars are the same
/// for all of them, of others every instance gets its element. Ref: UsdGeomPointInstancer,
/// "Primvars on PointInstancer".
class InstancerPrimvars {
  public:
    /// Reads what the image and the materials met so far ask for, which includes those of the
    /// prototypes once these are walked. What does not fit the instances is ignored with a warning.
    InstancerPrimvars(Context& ctx, Prim instancer, size_t instances);

    /// Values of an instance, added to the scene.
    ValueRange of(size_t instance);

    /// Warns of displacement by what is handed down: the prototype is displaced once for all.
    void warn_displacement(const std::vector<InstanceSource*>& prototypes);

  private:
    struct Source {
        scene::InstanceValue value;  ///< of the first instance
        std::vector<float> numbers;  ///< [row][width]
        std::vector<uint32_t> rows;  ///< [instance]; empty: one value for all
    };

    bool is_wanted(const std::string& name) const;

    Context& ctx_;
    Prim instancer_;
    std::vector<Source> sources_;
};

/// What an instance of a prototype hands to one that is nested in it: its own values before those
/// of the outer one, but for what yields.
ValueRange handed_on(scene::Scene& scene, const Placement& inner, const ValueRange& outer);

/// Gives a shape that enters the scene by itself what an instance would have handed down.
void inherit_primvars(const scene::Scene& scene,
                      const ValueRange& range,
                      std::vector<scene::Primvar>& primvars);

}  // namespace velatura::translate::instancing
