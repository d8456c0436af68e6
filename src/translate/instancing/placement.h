// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

#include <cstddef>

namespace velatura::translate::instancing {

/// State of this module: how much may be placed; see TranslateOptions.
struct PlacementLimits {
    size_t max_instances = 0, max_copies = 0;
};

/// Turns what the walk of the stage collected into Scene::shapes, prototypes, instances, lights.
void place_all(Context& ctx, InstanceSource& stage_content);

}  // namespace velatura::translate::instancing
