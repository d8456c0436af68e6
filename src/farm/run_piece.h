// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/piece_state.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace velatura::farm {

/// integrator::pilot_samples, which this tier does not include; `app` checks it.
inline constexpr uint64_t pilot_samples = 16;

/// How a piece is run; the functions can be called by several threads.
struct RunOptions {
    std::string build;  ///< build id of this program
    std::string node;   ///< empty: what the engine calls this machine, else its host name
    int threads = 0;    ///< of the render where the job says nothing; 0: it decides
    /// True: stop soon, with the samples so far.
    std::function<bool()> is_to_stop;
    /// Progress of the piece, 0 … 100.
    std::function<void(size_t piece, double percent)> on_progress;
};

/// Renders a piece and checks what it left; the state file tells all of it. A piece that is done
/// already is not rendered again. Where its work file is another render's, it starts anew.
/// Returns: the state that was written: Done, Waiting (stopped by a signal), Failed, GaveUp.
/// Errors: "farm-canceled" (nothing was done), "farm-piece", "io-write".
Result<PieceState> run_piece(const Job& job, size_t piece, const RunOptions& options);

/// The file of a finished part as it is on disk. Errors: "farm-part" (missing, damaged, not a
/// part).
Result<Part> inspect_part(const std::string& file);

/// Why the part of a piece that is done cannot be merged; empty if it can: missing, not the file
/// that was written, or of other samples. Reads all of it.
std::string problem_of_part(const Job& job, size_t piece, const PieceState& state);

/// What the engine calls this machine and this task: $SLURMD_NODENAME …, else the host name and "".
std::string node_name();
std::string task_name();

}  // namespace velatura::farm
