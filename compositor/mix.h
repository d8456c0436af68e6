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

/// A layer whose NaN and infinite values a mix took as 0.
struct NotFiniteLayer {
    std::string layer;
    size_t values = 0;
    int x = 0, y = 0;  ///< the first of them, row by row
};

/// The mixed picture over the data window: parts `rgba` (float, scene-linear, premultiplied, alpha
/// of the beauty) and, when asked for, the gained layers as float, with a header that `verify`
/// accepts. Unit gains give the beauty bit for bit, since the fold is the one that defines it.
/// Exposure is a gain on everything. Values that are not finite count as 0 and are told in
/// `not_finite` when it is given.
image::Image apply_mix(const LayerStack& stack,
                       const MixPlan& plan,
                       const Look& look,
                       bool with_layers,
                       std::vector<NotFiniteLayer>* not_finite = nullptr);

/// The same bits from a file whose pixels are read strip by strip, by several readers: only the
/// parts and channels that the mix needs. `layout` is the file's, without pixels. Memory: the mixed
/// picture and strips of at most `strip_bytes`, however many layers there are. Errors: "io-read".
Result<image::Image> mix_file(const image::StripReader& file,
                              const LayerStack& layout,
                              const MixPlan& plan,
                              const Look& look,
                              bool with_layers,
                              std::vector<NotFiniteLayer>* not_finite = nullptr,
                              size_t strip_bytes = size_t(1) << 30);

/// Shows a mixed picture through the look's display and view and writes .png or .jpg of the display
/// window. Errors: "ocio-config", "ocio-view", "io-write".
Result<void> write_display(const std::string& path, const image::Image& mixed, const Look& look);

}  // namespace velatura::compositor
