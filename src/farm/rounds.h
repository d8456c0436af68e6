// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/merge_job.h"

#include <cstdint>
#include <vector>

namespace velatura::farm {

/// Whether a merged frame needs more samples for the target of its job: its error is above it, and
/// it has fewer than Job::max_spp.
bool needs_samples(const Job& job, const FrameResult& result);

/// Samples of each pixel for which a frame is expected to reach the target: at most 4 times those
/// that it has, in steps of a sixteenth of a power of two as one render takes them. Errors fall by
/// a power of the samples between -0.5 and -0.75 (statistics::ErrorCurve).
uint64_t next_spp(const Job& job, const FrameResult& result);

/// Adds a round of pieces to each frame that is merged and needs samples. Returns: their numbers;
/// none: no frame does. Errors: "farm-piece" (damaged file), "io-write".
Result<std::vector<size_t>> add_round(Job& job);

}  // namespace velatura::farm
