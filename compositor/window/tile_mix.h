// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix.h"
#include "image/display.h"

#include <cstdint>
#include <vector>

namespace velatura::compositor::window {

/// Part of a mix, scene-linear, [height][width][3] of `tile`, which counts from the top left of the
/// image (the display window); pixels that are not stored are 0. The numbers of apply_mix, bit
/// for bit: the same products and sums in the same order.
std::vector<float> mix_tile(const LayerStack& stack,
                            const mix::MixPlan& plan,
                            float exposure_stops,
                            const image::Window& tile);

/// What the screen shows, [pixel][4], opaque: the bytes that write_display puts into an image.
std::vector<uint8_t> display_rgba(std::vector<float> rgb, const image::DisplayTransform& transform);

}  // namespace velatura::compositor::window
