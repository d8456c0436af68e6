// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::geometry {

/// A shape of a scene, and where it stands there.
struct ListedShape {
    const scene::Shape* shape = nullptr;
    uint32_t prototype = scene::none;  ///< none: placed directly, in Scene::shapes
    size_t index = 0;                  ///< among the shapes there
    bool is_light = false;             ///< light is sampled from it
};

/// All shapes: those placed directly, then those of each prototype. One flat list, so that a scene
/// of one big prototype is as parallel as one of many shapes.
std::vector<ListedShape> list_shapes(const scene::Scene& scene);

}  // namespace velatura::geometry
