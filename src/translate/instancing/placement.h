// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/placeable.h"

#include <cstddef>

namespace velatura::translate::instancing {

/// State of this room: how much may be placed; see TranslateOptions.
struct PlacementLimits {
    size_t max_instances = 0, max_copies = 0;
};

/// Turns what the walk of the stage collected into Scene::shapes, prototypes, instances, lights.
void place_all(Context& ctx, Placeable& stage_content);

}  // namespace velatura::translate::instancing
