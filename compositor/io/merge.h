// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/window.h"
#include "layers/layer_file.h"
#include "layers/sums_reader.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// [first, end) of sample indices.
using SampleRange = std::pair<uint64_t, uint64_t>;

struct MergeOptions {
    bool keep_sums = false;           ///< leave the exact sums in, for --resume and further merges
    bool accepts_incomplete = false;  ///< also files that were stopped before they had all samples
    std::optional<SampleRange> expected;               ///< what the parts must cover together
    size_t strip_bytes = layers::default_strip_bytes;  ///< of the sums of a part, at a time
};

/// A file to merge, as its header describes it.
struct MergePart {
    std::string path;
    SampleRange samples;             ///< that it was to have
    image::Window window;            ///< its pixels
    bool is_complete = true;         ///< it has them
    std::vector<std::string> lacks;  ///< plugins and files that its render did not find
};

/// Why files are not merged.
struct MergeFault {
    std::string kind;                    ///< "gap", "overlap", "settings" …: docs of merge --json
    std::string text;                    ///< for people, with the names of the files
    std::vector<std::string> files;      ///< that are to be rendered again
    std::optional<SampleRange> samples;  ///< of a gap or overlap
    std::string code = "merge-refused";
    std::optional<image::Window> window = {};  ///< of a gap or overlap that only some pixels have
};

struct MergeReport {
    std::vector<MergePart> parts;    ///< by samples, then from top to bottom
    std::vector<MergeFault> faults;  ///< empty: merged
    std::optional<SampleRange> samples;
    bool is_complete = false;  ///< all parts are
};

/// Joins files that hold adjacent sample ranges, crops, or both of one render into the file that
/// one render of all the samples of the smallest window around them writes, bit for bit in every
/// pixel. Every pixel of that window must have all samples. Beside the sums of the result a strip
/// of the parts is in memory: what it takes does not grow with the number of parts, but
/// for their headers. Errors:
/// "merge-refused" (exit 5: incomplete, no sums, other scene, settings, build, files, seed, layers
/// or resolution, overlap, gap, not what is expected); its message has a line for each of
/// report.faults. Those of reading and of layers::write_layer_file.
Result<layers::WriteReport> merge_files(const std::vector<std::string>& inputs,
                                        const std::string& output,
                                        const MergeOptions& options,
                                        MergeReport& report);

}  // namespace io
}  // namespace velatura::compositor
