// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/bake/bake.h"
#include "compositor/io/layer_stack.h"

#include <string>
#include <vector>

namespace velatura::compositor::bake {

/// A light group mixed, and rendered with the mix baked in.
struct BakeCheckRow {
    std::string group;                 ///< `all` for the whole image
    double composite = 0, render = 0;  ///< mean of R, G and B
    /// Difference of the means, and excess of the squared differences of 8×8 blocks over what noise
    /// makes of them, both in standard errors.
    double mean_sigmas = 0, block_sigmas = 0;
    bool is_compared = true;  ///< false where some prims of a group are baked and others are not

    bool agrees() const;
};

/// Compares the pixels that both files have, against the noise that the half images of both
/// predict; what clamps took is given back. The whole image is that of the groups that can be
/// compared. Errors: those of plan_mix, "halves-not-stored", "diff-window" (no pixel in common).
Result<std::vector<BakeCheckRow>> check_bake(const LayerStack& mixed,
                                             const Bake& bake,
                                             const LayerStack& rendered);

}  // namespace velatura::compositor::bake
