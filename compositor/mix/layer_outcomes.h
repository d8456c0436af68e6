// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix_plan.h"

#include <cstdint>
#include <map>
#include <string>

namespace velatura::compositor::mix {

/// How a mix with layers stores a layer of its input.
enum class LayerOutcome : uint8_t {
    Same,       ///< unchanged: data, Cryptomattes, channels that the header does not list
    Graded,     ///< graded: of the family of the mix, with the direct light of lifted shadows
    Sum,        ///< of a coarser family: the sum of graded layers
    Shadow,     ///< graded, minus its lifted part
    Beside,     ///< graded: unoccluded light, rows of a file of another renderer
    Uniform,    ///< graded, since all light has the same gain
    Clamp,      ///< graded, minus the part of the clamp that was undone
    Beauty,     ///< the sum of the family
    Variance,   ///< that of the mixed beauty
    NotStored,  ///< parts of its light have different gains
};

/// Outcome of each layer of the header, by name. exposure: a factor.
std::map<std::string, LayerOutcome> layer_outcomes(const LayerStack& layout,
                                                   const MixPlan& plan,
                                                   float exposure);

/// Layers that a mix with layers does not store, as text: `7 layers of lobes, exact sums`; empty
/// when all are stored.
std::string layers_not_stored(const LayerStack& layout, const MixPlan& plan, float exposure);

}  // namespace velatura::compositor::mix
