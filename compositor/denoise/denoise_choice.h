// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/denoise/denoise_kernel.h"

#include <functional>
#include <vector>

namespace velatura::compositor::denoise {

/// Which filter serves which pixel.
struct FilterChoice {
    std::vector<DenoiseFilter> filters;
    /// [filter, and after them "leave it as it is"][pixel]: shares that add up to 1.
    std::vector<Plane> shares;
};

/// Tries every filter on the judged mixes and takes, pixel by pixel, the one with the least error:
/// half A filtered by weights from B is compared with B, and the other way round, so that the noise
/// a result is compared with is none that it was made from (Rousselle et al. 2012). Errors are
/// smoothed before the choice, and the choice after it. Without half images: the middle filter
/// everywhere.
FilterChoice choose_filters(const DenoiseGuides& guides);

/// Adds up the chosen filters' weights for a tile. scratch: memory to work in.
void chosen_weights(DenoiseKernel& kernel,
                    const FilterChoice& choice,
                    const image::Window& window,
                    int x,
                    int y,
                    int half,
                    DenoiseKernel::Weights& weights,
                    DenoiseKernel::Weights& scratch);

/// Calls body(kernel, x, y) for every tile of the window, on the threads allowed; x, y from the
/// window's corner.
void for_each_tile(const DenoiseGuides& guides,
                   const std::function<void(DenoiseKernel&, int, int)>& body);

}  // namespace velatura::compositor::denoise
