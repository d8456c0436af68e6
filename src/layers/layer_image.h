// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "layers/layer_file.h"

namespace velatura::layers {

/// What write_layer_file writes, without the sums themselves and digests, as an image in memory.
/// info: what names the file and its storage is not used. Errors: "no-samples", "closure-failed".
Result<image::Image> make_layer_image(const accumulate::SampleSums& sums, const FileInfo& info);

}  // namespace velatura::layers
