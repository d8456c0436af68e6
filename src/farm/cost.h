// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "farm/job.h"
#include "farm/piece_state.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::farm {

/// Wall time of the pieces of a frame on the machines of the job.
struct FrameCost {
    double start_s = 0;   ///< of a piece, whatever its samples: reading, preparing, writing
    double sample_s = 0;  ///< of one sample of each pixel
};

/// As the pieces of a frame that are done took it; nothing where none is.
std::optional<FrameCost> measured_cost(const Job& job,
                                       const std::vector<PieceState>& states,
                                       size_t frame);

/// The same of a frame without pieces, linear between the nearest frames with some.
std::optional<FrameCost> expected_cost(const Job& job,
                                       const std::vector<PieceState>& states,
                                       size_t frame);

/// Into how many ranges samples are split so that each takes about `piece_time_s`, or longer, so
/// that in the mean a start is at most that share of a piece.
uint64_t range_count(const FrameCost& cost,
                     uint64_t samples,
                     double piece_time_s,
                     double max_start_share);

}  // namespace velatura::farm
