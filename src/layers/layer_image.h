// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "image/image.h"
#include "layers/layer_file.h"

namespace velatura::layers {

/// The content of a file of light layers in memory.
struct LayerImage {
    image::Image image;  ///< pixels at their stored precision, with all attributes
    WriteReport report;  ///< without files
};

/// What write_layer_file() writes.
/// Args:   is_verified: with digests, and checked as a file is; false saves their time for an image
///         that is only shown. The report then has no counts.
/// Errors: "closure-failed", "no-samples", "sums-folded"; verified also "verify-failed".
Result<LayerImage> make_layer_image(const accumulate::SampleSums& sums,
                                    const FileInfo& info,
                                    bool is_verified = true);

}  // namespace velatura::layers
