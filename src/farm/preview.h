// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/merge_job.h"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace velatura::farm {

/// What the interim image of a frame shows.
struct Preview {
    uint64_t first = 0, end = 0;   ///< its samples
    std::optional<ErrorAt> error;  ///< that it states; nothing: unknown
    bool has_png = false;          ///< there is a PNG beside the EXR
};

/// Nothing where a frame has none. A damaged file counts as none: the next one replaces it.
std::optional<Preview> read_preview(const Job& job, size_t frame);

/// Merges the pieces of a frame that are done and adjacent, as an EXR and a PNG, where they have at
/// least twice the samples of the image before: all previews together read as many parts as one
/// merge more. Returns: whether it is renewed; not where another process does so. Errors: those of
/// reading states; what a merge refuses is in its log, and ends nothing.
Result<bool> renew_preview(const Job& job, size_t frame);

/// The PNG of a frame whose image is written. Its interim EXR is removed.
void finish_preview(const Job& job, size_t frame);

}  // namespace velatura::farm
