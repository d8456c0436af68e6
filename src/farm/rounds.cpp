// SPDX-License-Identifier: Apache-2.0
#include "farm/rounds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace velatura::farm {

namespace {

/// How the error will fall, error ∝ samples^−slope: half way between that of the last two rounds
/// and the steepest. Too few samples cost another round, too many cannot be taken back.
double slope_of(const std::vector<ErrorAt>& errors) {
    constexpr double lowest = 0.5, highest = 0.75, usual = 0.6;
    if (errors.size() < 2) return usual;
    const ErrorAt &a = errors[errors.size() - 2], &b = errors.back();
    const double doublings = std::log2(double(b.spp) / double(a.spp));
    // Over less than a doubling the noise of the estimates decides
    if (doublings < 1 || a.error <= 0 || b.error <= 0) return usual;
    const double seen = std::log2(a.error / b.error) / doublings;
    return 0.5 * (std::clamp(seen, lowest, highest) + highest);
}

}  // namespace

bool needs_samples(const Job& job, const FrameResult& result) {
    if (job.target_error <= 0 || result.errors.empty()) return false;
    const ErrorAt& last = result.errors.back();
    return last.error > job.target_error && last.spp < job.max_spp;
}

uint64_t next_spp(const Job& job, const FrameResult& result) {
    constexpr double most = 4;
    const ErrorAt& last = result.errors.back();
    const double ratio =
        std::min(most, std::pow(last.error / job.target_error, 1 / slope_of(result.errors)));
    const double wanted = double(last.spp) * ratio;
    const uint64_t unit = std::max<uint64_t>(1, std::bit_floor(uint64_t(wanted)) / 16);
    const uint64_t spp = (uint64_t(std::ceil(wanted)) + unit - 1) / unit * unit;
    return std::min(std::max(spp, last.spp + unit), job.max_spp);
}

Result<std::vector<size_t>> add_round(Job& job) {
    std::vector<Piece> pieces;
    for (size_t frame = 0; frame < job.frames.size(); ++frame) {
        const auto result = read_result(job, frame);
        if (!result) return result.error();
        if (!*result || !needs_samples(job, **result)) continue;
        const uint64_t first = job.spp_of(frame), end = next_spp(job, **result);
        const uint64_t count =
            job.ranges > 0 ? job.ranges : default_pieces(end - first, job.frames.size());
        for (Piece piece : split_samples(first, end, count)) {
            piece.frame = frame;
            pieces.push_back(piece);
        }
    }
    std::vector<size_t> numbers;
    if (pieces.empty()) return numbers;
    const size_t had = job.pieces.size();
    if (const auto ok = add_pieces(job, pieces); !ok) return ok.error();
    for (size_t i = had; i < job.pieces.size(); ++i) numbers.push_back(i);
    return numbers;
}

}  // namespace velatura::farm
