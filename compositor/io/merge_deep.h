// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// Joins deep images of crops of one render into the deep image of the smallest window around them,
/// sample by sample as they stand; every pixel of it must be in one file. Errors: "merge-refused"
/// (another scene, camera, size or way to gather the samples, overlap, gap), those of reading and
/// of layers::write_deep_file.
Result<void> merge_deep_files(const std::vector<std::string>& inputs, const std::string& output);

}  // namespace io
}  // namespace velatura::compositor
