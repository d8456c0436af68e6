// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/controls.h"
#include "compositor/layer_stack.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor {

/// A mix in terms of what the file stores.
struct MixPlan {
    /// Stored layers and their gain per channel, in the order in which they are folded.
    struct Term {
        std::string layer;
        std::array<float, 3> gain = {1, 1, 1};
    };

    std::string family;              ///< whose layers are gained: matrix, bounces, groups, beauty
    std::vector<Term> terms;         ///< the family, in the order of its closure
    std::vector<Term> shadow_terms;  ///< S_<group>, added after them
};

/// Translates a look into gains of the finest stored family that can express it.
/// Errors: "unknown-name" (usage; lists the names there are), "mix-not-stored" (says which layers
/// to render).
Result<MixPlan> plan_mix(const LayerStack& stack, const Look& look);

/// The mixed picture over the data window: parts `rgba` (float, scene-linear, premultiplied, alpha
/// of the beauty) and, when asked for, the gained layers as float, with a header that `verify`
/// accepts. Unit gains give the beauty bit for bit, since the fold is the one that defines it.
/// Exposure is a gain on everything.
image::Image apply_mix(const LayerStack& stack,
                       const MixPlan& plan,
                       const Look& look,
                       bool with_layers);

/// Shows a mixed picture through the look's display and view and writes .png or .jpg of the display
/// window. Errors: "ocio-config", "ocio-view", "io-write".
Result<void> write_display(const std::string& path, const image::Image& mixed, const Look& look);

}  // namespace velatura::compositor
