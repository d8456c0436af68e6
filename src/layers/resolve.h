// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_entry.h"
#include "accumulate/sample_sums.h"
#include "image/image.h"

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::layers {

/// How one family adds up to the beauty.
struct FamilyClosure {
    std::string family;
    std::vector<std::string> order;  ///< stored layers, as folded
    bool is_exact = false;           ///< the finest family: bit for bit
    /// |fold − independent beauty| <= relative · Σ|layer| + absolute, per pixel and channel.
    double relative = 0, absolute = 0;
    double measured = 0;           ///< largest difference in units of the bound
    double measured_absolute = 0;  ///< largest difference
};

/// Everything a file stores, at its stored precision, with the beauty defined by closure.
struct ResolvedLayers {
    image::Image image;  ///< parts rgba, families, data, halves; no attributes
    std::vector<accumulate::LayerEntry> layers;
    std::vector<FamilyClosure> closure;   ///< finest first; empty when no family is stored
    std::vector<std::string> overflowed;  ///< layers stored float because half would overflow
    double storage_error = 0;  ///< √relMSE that rounding to the stored precision left in the beauty
    std::string first_failure;  ///< where closure or finiteness broke; empty = nowhere
};

/// A value that a clamp cut, and what that took.
struct ClampedValue {
    float cut = 0, taken = 0;  ///< their sum in float is the whole value
};

/// whole >= cut >= 0, finite. The cut value moves by half a rounding of the whole one where no
/// float would else make up the difference; it stays if both are halves.
ClampedValue undoable_cut(float whole, float cut);

ResolvedLayers resolve_layers(const accumulate::SampleSums& sums);

/// The rounding bound of a fold of `count` stored layers; `has_half` if any of them is stored half.
void set_bound(FamilyClosure& closure, size_t count, bool has_half);

}  // namespace velatura::layers
