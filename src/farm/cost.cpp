// SPDX-License-Identifier: Apache-2.0
#include "farm/cost.h"

#include <algorithm>
#include <cmath>

namespace velatura::farm {

std::optional<FrameCost> measured_cost(const Job& job,
                                       const std::vector<PieceState>& states,
                                       size_t frame) {
    double samples = 0, trace_s = 0, start_s = 0, pieces = 0;
    for (const size_t i : job.pieces_of(frame)) {
        const PieceState& s = states[i];
        if (s.state != State::Done) continue;
        const auto count = double(job.pieces[i].end - job.pieces[i].first);
        samples += count;
        ++pieces;
        const Attempt& last = s.attempts.back();
        if (s.attempts.size() == 1 && last.trace_s > 0) {
            trace_s += last.trace_s;
            start_s += std::max(0.0, last.wall_s - last.trace_s);
            continue;
        }
        // It went on from the samples of an earlier start
        for (const Attempt& a : s.attempts) trace_s += a.wall_s;
    }
    if (samples <= 0) return std::nullopt;
    return FrameCost{start_s / pieces, trace_s / samples};
}

std::optional<FrameCost> expected_cost(const Job& job,
                                       const std::vector<PieceState>& states,
                                       size_t frame) {
    std::optional<FrameCost> before, after;
    size_t at_before = 0, at_after = 0;
    for (size_t i = frame + 1; i-- > 0 && !before;)
        if ((before = measured_cost(job, states, i))) at_before = i;
    for (size_t i = frame; i < job.frames.size() && !after; ++i)
        if ((after = measured_cost(job, states, i))) at_after = i;
    if (!before || !after || at_before == at_after) return before ? before : after;
    const double t = double(frame - at_before) / double(at_after - at_before);
    return FrameCost{std::lerp(before->start_s, after->start_s, t),
                     std::lerp(before->sample_s, after->sample_s, t)};
}

uint64_t range_count(const FrameCost& cost,
                     uint64_t samples,
                     double piece_time_s,
                     double max_start_share) {
    const double left_s = piece_time_s - cost.start_s;
    const double least_s = cost.start_s * (1 / max_start_share - 1);
    const double count = double(samples) * cost.sample_s / std::max(left_s, least_s);
    const double wanted = left_s < least_s ? std::floor(count) : std::ceil(count - 0.25);
    return std::clamp<uint64_t>(wanted > 1 ? uint64_t(std::min(wanted, 1e6)) : 1, 1,
                                std::max<uint64_t>(samples, 1));
}

}  // namespace velatura::farm
