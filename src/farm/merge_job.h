// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/piece_state.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::farm {

/// What became of a frame.
struct FrameResult {
    std::string output;
    std::string problem;  ///< why the merge failed; empty: the output is written
    std::string sha256;   ///< of all pixel data, as `velatura-comp merge` prints it
    double wall_s = 0;    ///< of the merge
};

/// Nothing: no merge of the frame has ended, or its output is gone. Errors: "farm-piece" (damaged
/// file).
Result<std::optional<FrameResult>> read_result(const Job& job, size_t frame);

/// Merges the parts of a frame into its output, once each is found to be the file that was written,
/// with the scene and settings of the others; a part that is not fails its piece. Returns: nothing
/// where pieces are missing. Errors: "farm-merge" (the merge itself fails), "farm-piece",
/// "io-write".
Result<std::optional<FrameResult>> merge_frame(const Job& job, size_t frame);

/// The same for every frame that is not merged yet. Goes on behind a failed merge. Errors: the
/// first one.
Result<void> merge_frames(const Job& job);

}  // namespace velatura::farm
