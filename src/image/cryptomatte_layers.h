// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/layer_file.h"
#include "image/resolve.h"
#include "image/sample_sums.h"

namespace velatura::image {

/// Adds a part per Cryptomatte of the sums: the preview CryptoObject.R/G/B and the ranked pairs of
/// id and coverage CryptoObject00.R/G/B/A …; greatest coverage first, of equal ones the lower id.
/// The manifest holds the names of what some pixel sees.
void add_cryptomattes(const SampleSums& sums, const MatteNames& names, ResolvedLayers& resolved);

/// Appends the exact sums to the part of sums: `sums_matte<slot>.kind`, `.id`, `.w0`, `.w1` per
/// pixel, as many slots as the fullest pixel needs.
void store_matte_sums(const MatteSums& mattes, const Window& window, Part& part);

/// Errors: "sums-damaged".
Result<void> read_matte_sums(const Image& image, MatteSums& mattes);

}  // namespace velatura::image
