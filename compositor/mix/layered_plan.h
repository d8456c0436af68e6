// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/mix_plan.h"
#include "layers/layer_header.h"

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

inline constexpr std::array<const char*, 3> rgb_names = {"R", "G", "B"};

/// R, G or B of a layer, or of a half image of it.
struct LayerChannel {
    std::string layer, half;  ///< half: "", "_hA" or "_hB"
    size_t c = 0;

    /// Name of the layer or of its half image in the header of a file of ours.
    std::string full_name() const;
};

/// A plan of a mix, extended by what the mix does with each layer of the file. Refers to `layout`
/// and `mix`.
struct LayeredPlan {
    LayeredPlan(const LayerStack& layout, const MixPlan& mix, float exposure);

    /// The gain of a layer that is gained beside the family; null: it has none.
    const MixPlan::Term* beside(const std::string& layer) const;
    /// Layers of the family whose sum is a coarser layer: that of a bounce or of a group.
    std::vector<std::string> sources_of(const accumulate::LayerEntry& coarser) const;

    const LayerStack& layout;
    const MixPlan& mix;
    float exposure;                                ///< a factor
    std::map<std::string, LayerOutcome> outcomes;  ///< by layer
    std::vector<std::string> halves = {""};  ///< suffixes of the layer itself and its half images
    std::vector<MixPlan::Term> terms;  ///< of the family, with layers that were black and are lit
};

}  // namespace velatura::compositor::mix
