// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "scene/scene.h"
#include "translate/translate.h"
#include "usd/stage/stage.h"

#include <vector>

namespace velatura::translate {

/// Adds where things are at other instants to a scene that translate_stage() made with the same
/// options: Scene::moments, and the primvars that they name. The stage is translated once for each;
/// what is at none of them where the scene has it is matched by prim, and by the order of instances
/// of one prim. A frame is one time code. Meshes with velocities go by these. Warnings:
/// "motion-vectors" (prims that cannot be matched: their vectors are those of the camera alone;
/// nothing moves at the default time).
void add_moments(const usd::stage::Stage& stage,
                 const TranslateOptions& options,
                 const std::vector<scene::MomentKind>& kinds,
                 scene::Scene& scene,
                 Diagnostics& diagnostics);

}  // namespace velatura::translate
