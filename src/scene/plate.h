// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"

namespace velatura::scene {

/// What a plate shows of the scene: its lights and its catchers (Linking::catchers), which are no
/// catchers there, without any other geometry and without volumes. Ids of materials, textures,
/// lights and places in files stay; those of shapes, prototypes and instances do not, so casters
/// and moments are left out.
Scene plate_of(const Scene& scene);

}  // namespace velatura::scene
