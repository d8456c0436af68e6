// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "layers/layer_file.h"

#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// Joins files that hold adjacent sample ranges of one render into the file that one render of all
/// the samples writes, bit for bit in every pixel. `keep_sums` leaves the exact sums in, for
/// further merges. Errors: "merge-refused" (exit 5: no sums, other scene, settings, seed, layers or
/// window, overlap, gap), those of reading and of image::write_layer_file.
Result<layers::WriteReport> merge_files(std::vector<std::string> inputs,
                                        const std::string& output,
                                        bool keep_sums);

}  // namespace io
}  // namespace velatura::compositor
