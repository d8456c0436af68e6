// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/environment_image.h"

namespace velatura::render {

/// Reads light textures from disk, decoded to scene-linear colour.
lights::ImageLoader make_light_image_loader();

}  // namespace velatura::render
