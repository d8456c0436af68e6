// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/merge.h"
#include "layers/layer_header.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// What the header of a file to merge says.
struct PartHeader {
    std::string path;
    MergePart part;
    layers::SampleInfo samples;
    layers::FileInfo info;
    image::Window display;
    nlohmann::json layer_set;  ///< of its sums
    nlohmann::json settings;   ///< velatura/settings; null where there is none
    std::string samples_text;  ///< velatura/samples, as it stands
};

/// Reads the headers alone, by samples and then from top to bottom; adds files that cannot be parts
/// to the faults.
std::vector<PartHeader> read_part_headers(const std::vector<std::string>& paths,
                                          std::vector<MergeFault>& faults);

/// Adds all that keeps the files from being parts of one render with the samples expected. Parts
/// that differ are compared with the file that most others agree with.
void find_faults(const std::vector<PartHeader>& parts,
                 const MergeOptions& options,
                 std::vector<MergeFault>& faults);

/// The smallest window that holds those of all parts.
image::Window window_of(const std::vector<PartHeader>& parts);

/// An index above those of all samples: adaptive sampling gives pixels more than the render was to
/// have in the mean.
uint64_t end_of_samples(const std::vector<PartHeader>& parts);

/// velatura/settings of the parts together.
std::string merged_settings(const std::vector<PartHeader>& parts);

/// velatura/stats of the parts, of which crops measured some differently: what all of them say.
std::string common_stats(const std::vector<PartHeader>& parts);

}  // namespace io
}  // namespace velatura::compositor
