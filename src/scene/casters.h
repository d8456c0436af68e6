// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/ids.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace velatura::scene {

/// One name for what casts shadows.
struct Caster {
    std::string name;  ///< as authored, or that of the prim
    std::string prim;  ///< path; empty where a name was authored
};

/// What shadows are told apart by (docs/reference/layers.md). Empty unless layers by caster are
/// wanted.
struct Casters {
    std::vector<Caster> list;
    std::vector<CasterId> shapes;             ///< of Scene::shapes
    std::vector<std::vector<CasterId>> rows;  ///< [row][shape of the prototype]
    std::vector<uint32_t> row_of_instance;    ///< of Scene::instances, into rows
    CasterId volumes = none;                  ///< of all of them; none: they have none in common

    /// Of a shape as the instance places it; instance none = placed directly. none: nobody known.
    CasterId of(uint32_t instance, ShapeId shape) const {
        if (instance == none) return shape < shapes.size() ? shapes[shape] : none;
        return instance < row_of_instance.size() ? rows[row_of_instance[instance]][shape] : none;
    }
};

}  // namespace velatura::scene
