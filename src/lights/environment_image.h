// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "base/result.h"
#include "scene/light.h"

#include <functional>
#include <vector>

namespace velatura::lights {

/// A decoded light texture (dome or rect): scene-linear working-space color.
struct EnvironmentImage {
    int width = 0, height = 0;
    std::vector<Rgb> texels;  ///< [height][width], row 0 = top
};

/// Gives the decoded pixels of light.texture_file; called once per textured light. The error's
/// message goes into a warning at the light, which then emits without its texture.
using ImageLoader = std::function<Result<EnvironmentImage>(const scene::Light& light)>;

}  // namespace velatura::lights
