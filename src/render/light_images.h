// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lights/environment_image.h"

namespace velatura::render {

/// Loader of light textures for lights::LightSet: reads image files, decodes them to scene-linear
/// color.
lights::ImageLoader make_light_image_loader();

}  // namespace velatura::render
