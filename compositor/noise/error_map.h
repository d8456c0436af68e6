// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/noise/noise.h"
#include "image/image.h"

#include <string>

namespace velatura::compositor::noise {

/// Edge of the window that errors are pooled over, less one, halved; pixels.
inline constexpr int pooling_radius = 3;

/// Where a mix is noisy, pooled over windows: R, G, B the standard error of each channel, in the
/// units of the image, and `relative` that of the pixel as √relMSE counts it. Data, no beauty.
image::Image error_image(const LayerStack& stack, const MixError& mix);

/// The same for the eye, as .png or .jpg over the display window: `relative` by its share of
/// `middle` (√relMSE of the image), a 16th and less black, 16 times and more white, in equal
/// steps of stops. A scale of the colors with numbers is below it. Errors: "io-write".
Result<void> write_error_image(const std::string& path, const image::Image& errors, double middle);

}  // namespace velatura::compositor::noise
