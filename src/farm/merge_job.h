// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/piece_state.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::farm {

/// The error that a merged image states.
struct ErrorAt {
    uint64_t spp = 0;
    double error = 0;          ///< relative standard error
    bool is_lower = false;     ///< the error is no less than that
    double low = 0, high = 0;  ///< 95 % interval; 0: unknown
};

/// What became of a frame.
struct FrameResult {
    std::string output;
    std::string problem;          ///< why the merge failed, or its error is not known; empty: done
    std::string sha256;           ///< of all pixel data, as `velatura-comp merge` prints it
    double wall_s = 0;            ///< of the merge
    uint64_t spp = 0;             ///< samples of each pixel that were merged
    std::vector<ErrorAt> errors;  ///< of the rounds so far
    std::string limit;            ///< which limit of the job allows no further round; empty: none

    /// Whether the last error is that of this image: a merge may not find one.
    bool has_error() const { return !errors.empty() && errors.back().spp == spp; }
};

/// Nothing: no merge of the samples that the frame's pieces have now has ended, or its output is
/// gone. Errors: "farm-piece" (damaged file).
Result<std::optional<FrameResult>> read_result(const Job& job, size_t frame);

/// The same of the last merge that has ended, whatever the pieces are now.
Result<std::optional<FrameResult>> stored_result(const Job& job, size_t frame);

/// Errors: "io-write".
Result<void> write_result(const Job& job, size_t frame, const FrameResult& result);

/// The error that an image states in its header; nothing where it is not known. `spp`: its samples.
std::optional<ErrorAt> stated_error(const std::string& file, uint64_t spp);

/// Merges the parts of a frame into its output, once each is found to be the file that was written,
/// with the scene and settings of the others; a part that is not fails its piece. Where the job has
/// a target and the error of the image is not known, that is a problem of the result. Returns:
/// nothing where pieces are missing, or not all samples have pieces yet. Errors: "farm-merge" (the
/// merge itself fails), "farm-piece", "io-write".
Result<std::optional<FrameResult>> merge_frame(const Job& job, size_t frame);

/// The same of a frame of several, by the piece that ended last: a merge task would do one frame
/// after the other. Nothing where another process merges it, or it is merged; what fails is left to
/// merge_frames().
void merge_finished_frame(const Job& job, size_t frame);

/// The same for every frame that is not merged yet. Goes on behind a failed merge. Errors: the
/// first one.
Result<void> merge_frames(const Job& job);

}  // namespace velatura::farm
