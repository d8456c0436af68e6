// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"
#include "image/layer_entry.h"
#include "image/sample_sums.h"

#include <vector>

namespace velatura::image {

/// The part `data`: albedo, N, P, Z, st, ids, counts and variance. Adds its layers to the list, and
/// those under other names.
Part data_part(const SampleSums& sums, std::vector<LayerEntry>& layers);

}  // namespace velatura::image
