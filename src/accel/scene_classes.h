// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "accel/traverse.h"

namespace velatura::accel {

/// Fills trees.classes, and the WideNode::classes of the trees over what is placed directly, over
/// instances, and in prototypes, where all bits are set. Nothing for a scene without classes.
void set_classes(const SoupScene& scene, SceneTrees& trees);

size_t bytes(const SceneClasses& classes);

}  // namespace velatura::accel
