// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "layers/layer_file.h"
#include "layers/resolve.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace velatura::layers {

/// How much of a pixel one id covers.
struct MatteShare {
    uint32_t id = 0;
    double coverage = 0;
};

/// A part for a Cryptomatte: the preview layer.R/G/B (half) and ranked pairs of id and coverage
/// layer00.R/G/B/A … (float), all 0. levels: pairs, rounded up to an even number.
image::Part make_matte_part(const std::string& layer, int levels, size_t pixels);

/// Fills the channels of make_matte_part() for one pixel. ranked: the greatest coverage first; the
/// first `levels` of them are stored, all are in the preview.
void store_mattes(std::span<const MatteShare> ranked, int levels, size_t pixel, image::Part& part);

/// Adds a part per Cryptomatte of the sums: the preview CryptoObject.R/G/B and the ranked pairs of
/// id and coverage CryptoObject00.R/G/B/A …; greatest coverage first, of equal ones the lower id.
/// The manifest holds the names of what some pixel sees.
void add_cryptomattes(const accumulate::SampleSums& sums,
                      const MatteNames& names,
                      ResolvedLayers& resolved);

/// Appends the exact sums to the part of sums: `sums_matte<slot>.kind`, `.id`, `.w0`, `.w1` per
/// pixel, as many slots as the fullest pixel needs.
void store_matte_sums(const accumulate::MatteSums& mattes,
                      const image::Window& window,
                      image::Part& part);

/// True of the channels of store_matte_sums().
bool is_matte_sum(std::string_view channel_name);

/// Adds them to the mattes of sums that have all samples of the image already. Errors:
/// "sums-damaged" (also weights that so many samples cannot have).
Result<void> read_matte_sums(const image::Image& image, accumulate::SampleSums& sums);

}  // namespace velatura::layers
