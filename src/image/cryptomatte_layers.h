// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/layer_file.h"
#include "image/resolve.h"
#include "image/sample_sums.h"

#include <string_view>

namespace velatura::image {

/// Adds a part per Cryptomatte of the sums: the preview CryptoObject.R/G/B and the ranked pairs of
/// id and coverage CryptoObject00.R/G/B/A …; greatest coverage first, of equal ones the lower id.
/// The manifest holds the names of what some pixel sees.
void add_cryptomattes(const SampleSums& sums, const MatteNames& names, ResolvedLayers& resolved);

/// Appends the exact sums to the part of sums: `sums_matte<slot>.kind`, `.id`, `.w0`, `.w1` per
/// pixel, as many slots as the fullest pixel needs.
void store_matte_sums(const MatteSums& mattes, const Window& window, Part& part);

/// True of the channels of store_matte_sums().
bool is_matte_sum(std::string_view channel_name);

/// Adds them to the mattes of sums that have all samples of the image already. Errors:
/// "sums-damaged" (also weights that so many samples cannot have).
Result<void> read_matte_sums(const Image& image, SampleSums& sums);

}  // namespace velatura::image
