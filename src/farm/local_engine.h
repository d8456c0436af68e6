// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/run_piece.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace velatura::farm {

struct LocalOptions {
    RunOptions run;
    /// After each start of a piece; one call at a time.
    std::function<void(const Job& job, size_t piece, const PieceState& state)> on_piece;
    /// Before a further round, with its pieces.
    std::function<void(const Job& job, const std::vector<size_t>& pieces)> on_round;
};

/// Runs what lacks of a job on this machine, Job::slots pieces at a time, and merges each frame
/// whose pieces are done, round by round, until nothing is left that can be tried, or it is to
/// stop. Errors:
/// "output-locked" (another process does so), "farm-merge", "farm-piece", "io-write".
Result<void> run_local(Job job, const LocalOptions& options);

}  // namespace velatura::farm
