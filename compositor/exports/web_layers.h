// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

/// A size of an image in pixels.
struct WebSize {
    int width = 0, height = 0;

    bool operator==(const WebSize&) const = default;
};

/// The display window of a layer, [height][width][3]: 0 where nothing is stored, where a value is
/// not finite, and in channels that the layer lacks.
std::vector<float> window_of(const LayerStack& stack, const std::string& layer);

/// The mean over the area of each pixel, from one size to a smaller one.
std::vector<float> scaled_down(const std::vector<float>& rgb, WebSize from, WebSize to);

/// Layers of one size, as the page has them.
struct WebLayers {
    WebSize size;
    std::vector<std::vector<uint16_t>> halves;  ///< per layer: [height][width][3]
    std::vector<std::string> packed;            ///< the same (web_pack.h), in base64
    size_t bytes = 0;                           ///< of `packed`
    size_t clamped = 0;                         ///< values beyond halves
};

/// Layers at the largest size that takes at most `max_bytes`. Where that is not the size of the
/// image, its sides are those times one factor. Without layers where not even a 32nd of the sides
/// fits.
WebLayers fitted_layers(const LayerStack& stack,
                        std::span<const std::string> layers,
                        size_t max_bytes);

}  // namespace velatura::compositor::exports
