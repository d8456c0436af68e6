// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/scene_records.h"

#include <pxr/imaging/hd/sceneDelegate.h>

namespace velatura::hydra {

/// Authors inputs, shadows, shaping and light group of a light, or of geometry that is one.
void author_light(PXR_NS::HdSceneDelegate& delegate, const PXR_NS::SdfPath& id, AuthoredPrim& prim);

/// Categories of what it lights and of what casts its shadows.
LightLinkNames read_links(PXR_NS::HdSceneDelegate& delegate, const PXR_NS::SdfPath& id);

}  // namespace velatura::hydra
