// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_entry.h"
#include "accumulate/sample_sums.h"
#include "image/image.h"

#include <vector>

namespace velatura::layers {

/// The part `data`: albedo, N, P, Z, st, ids, counts and variance where the layer set has these,
/// those under other names, and named ones. Adds its layers to the list.
image::Part data_part(const accumulate::SampleSums& sums,
                      std::vector<accumulate::LayerEntry>& layers);

}  // namespace velatura::layers
