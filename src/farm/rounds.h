// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"
#include "farm/merge_job.h"
#include "farm/piece_state.h"

#include <cstdint>
#include <vector>

namespace velatura::farm {

/// Samples of the first piece of a frame whose pieces are split by their measured cost: more than
/// the pilot samples of adaptive sampling, so that all others take its rates.
inline constexpr uint64_t first_samples = 32;

/// The pieces that a job begins with. Where further ones are split by cost (Job::piece_time_s):
/// the first samples of every frame with a target, else of the first, middle and last frame.
std::vector<Piece> first_round(const Job& job);

/// The error of an image by all rounds of its frame: that which each stated, brought to the samples
/// of the last one by the usual power of -0.6, in a mean by their intervals. One image shows its
/// own error with a fourth of it open, and the rounds are to end by the error, not by that chance.
/// Without an interval, that of the last one. Needs an error.
double error_by_rounds(const std::vector<ErrorAt>& errors);

/// Whether a merged frame needs more samples for the target of its job: the error of its image is
/// known and above it, it has fewer than Job::max_spp, and no limit of the job has ended its
/// rounds.
bool needs_samples(const Job& job, const FrameResult& result);

/// Samples of each pixel for which a frame is expected to reach the target: at most 4 times those
/// that it has, an eighth more at least, in steps of a sixteenth of a power of two as one render
/// takes them. Errors fall by a power of the samples between -0.5 and -0.75
/// (statistics::ErrorCurve).
uint64_t next_spp(const Job& job, const FrameResult& result);

/// Whether a frame lacks samples that add_round() adds, limits aside. Errors: "farm-piece" (damaged
/// file).
Result<bool> lacks_pieces(const Job& job, const std::vector<PieceState>& states);

/// Adds pieces to each frame that lacks samples of Job::spp and whose pieces are done, and to each
/// that is merged and needs samples for the target, as far as the limits of the job allow. Returns:
/// their numbers; none: no frame does. Errors: "farm-piece" (damaged file), "io-write".
Result<std::vector<size_t>> add_round(Job& job);

}  // namespace velatura::farm
