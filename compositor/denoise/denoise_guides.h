// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::denoise {

using Plane = std::vector<float>;  ///< [height][width] of the data window, row 0 = top

/// The beauty as two independent estimates.
struct BeautyHalves {
    std::array<std::array<Plane, 3>, 2> half;  ///< [A, B][R, G, B]
    std::array<Plane, 3> variance;             ///< of one half, at least that of rounding
};

/// A sum of layers that a mix may bring up: what filters are judged by beside the beauty.
struct ReferenceMix {
    /// [A, B][R, G, B]: stored half images to add up.
    std::array<std::array<std::vector<const image::Channel*>, 3>, 2> layers;
    float gain = 1;  ///< brings its mean to that of the beauty

    float value(size_t half, size_t c, size_t pixel) const;
};

/// What the weights of the denoiser are found from.
struct DenoiseGuides {
    image::Window window;
    bool has_halves = false;  ///< else both halves of `color` are the beauty itself
    BeautyHalves color;
    /// The beauty, its indirect light and the brightest light groups; empty without half images.
    std::vector<ReferenceMix> references;
    /// Albedo, normal, logarithms of depth and of emission seen directly: scaled so that a
    /// difference of 1 is a different surface.
    std::vector<Plane> features;
    std::vector<std::string> notes;  ///< what is missing and what that costs
};

/// Of a file that check_denoisable accepts, which must outlive the guides. Errors: "denoise-inputs"
/// (neither half images nor the layer `variance` are stored).
Result<DenoiseGuides> denoise_guides(const LayerStack& stack);

}  // namespace velatura::compositor::denoise
