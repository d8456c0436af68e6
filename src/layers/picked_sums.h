// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "image/image.h"

#include <string_view>

namespace velatura::layers {

// What filters other than the mean keep, as bookkeeping channels: `sums_pick<layer>.there`, `.z`,
// `.v0` … `.v3` (bits of floats).

void store_picked_values(const accumulate::SampleSums& sums, image::Part& part);

bool is_picked_value(std::string_view channel_name);

/// Adds what the file holds. Errors: "sums-damaged".
Result<void> read_picked_values(const image::Image& image, accumulate::SampleSums& sums);

}  // namespace velatura::layers
