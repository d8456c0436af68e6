// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"

#include <string>
#include <vector>

namespace velatura::compositor::denoise {

/// What denoising did to a file.
struct DenoiseReport {
    std::vector<std::string> notes;  ///< what was missing and what that costs
    /// Mean luminance of the beauty after over before: gathering moves light between pixels, it
    /// does not promise to keep its sum.
    double energy_ratio = 1;
};

/// Every pixel of every light layer as one linear combination of its neighbors, with the same
/// weights for all layers (per half image), so that layers still add up and any gain may follow.
/// The answer is a file that `verify` accepts: layers at their stored precision, the beauty their
/// fold, half images of what is left of the noise, other layers as they were, `velatura/denoise` in
/// the header.
/// Errors: those of check_denoisable and denoise_guides, "denoised-twice", "closure-failed".
Result<image::Image> denoise(const LayerStack& stack, DenoiseReport& report);

}  // namespace velatura::compositor::denoise
