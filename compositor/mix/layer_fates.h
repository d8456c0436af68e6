// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix_plan.h"

#include <cstdint>
#include <map>
#include <string>

namespace velatura::compositor::mix {

/// What a mix with layers stores of a layer of its file.
enum class LayerFate : uint8_t {
    Same,       ///< its bits: data, Cryptomattes, channels that the header does not name
    Gained,     ///< of the family of the mix, with the direct light of lifted shadows
    Sum,        ///< of a coarser family: the sum of what was gained
    Shadow,     ///< gained, less what was lifted of it
    Beside,     ///< gained: unoccluded light, rows of a file of another renderer
    Uniform,    ///< gained, since all light has the same gain
    Clamp,      ///< gained, less what was given back of it
    Beauty,     ///< the sum of the family
    Variance,   ///< that of the mixed beauty
    NotStored,  ///< parts of its light have different gains
};

/// By name of the layers of the header; `exposure` is a factor.
std::map<std::string, LayerFate> layer_fates(const LayerStack& layout,
                                             const MixPlan& plan,
                                             float exposure);

/// What a mix with layers does not store, for people: `7 layers of lobes, exact sums`; empty where
/// everything is kept.
std::string layers_not_stored(const LayerStack& layout, const MixPlan& plan, float exposure);

}  // namespace velatura::compositor::mix
