// SPDX-License-Identifier: Apache-2.0
#include "farm/rounds.h"

#include "farm/cost.h"
#include "farm/run_piece.h"

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

/// What the attempts of a job took so far.
struct Spent {
    double cpu_s = 0, wall_s = 0;
    std::vector<double> frame_cpu_s;  ///< of the pieces of each frame
};

Spent spent_of(const Job& job, const std::vector<PieceState>& states) {
    Spent spent;
    spent.frame_cpu_s.resize(job.frames.size());
    double first_s = now_s();
    for (size_t i = 0; i < states.size(); ++i)
        for (const Attempt& a : states[i].attempts) {
            spent.cpu_s += a.cpu_s;
            spent.frame_cpu_s[job.pieces[i].frame] += a.cpu_s;
            first_s = std::min(first_s, a.start_s);
        }
    spent.wall_s = now_s() - first_s;
    return spent;
}

/// Samples [first, end) that a frame is to get.
struct Addition {
    size_t frame = 0;
    uint64_t first = 0, end = 0;
    std::optional<FrameResult> result;  ///< of a frame with a target
};

bool are_done(const Job& job, const std::vector<PieceState>& states, size_t frame) {
    const std::vector<size_t> pieces = job.pieces_of(frame);
    return std::all_of(pieces.begin(), pieces.end(),
                       [&](size_t i) { return states[i].state == State::Done; });
}

/// What each frame lacks, limits aside.
Result<std::vector<Addition>> wanted(const Job& job, const std::vector<PieceState>& states) {
    // Frames without pieces are split by the cost of those that have some
    const auto count = [&](State state) {
        return size_t(std::count_if(states.begin(), states.end(),
                                    [&](const PieceState& s) { return s.state == state; }));
    };
    const size_t done = count(State::Done);
    const bool is_measured = done > 0 && done + count(State::GaveUp) == states.size();
    std::vector<Addition> additions;
    for (size_t frame = 0; frame < job.frames.size(); ++frame) {
        const uint64_t had = job.spp_of(frame);
        if (had < job.spp) {
            if (had == 0 ? is_measured : are_done(job, states, frame))
                additions.push_back({frame, had, job.spp, std::nullopt});
            continue;
        }
        const auto result = read_result(job, frame);
        if (!result) return result.error();
        if (!*result || !needs_samples(job, **result)) continue;
        if (const uint64_t end = next_spp(job, **result); end > had)
            additions.push_back({frame, had, end, **result});
    }
    return additions;
}

/// Shortens what is added for a target to the share that the limits of the job leave. Where little
/// is left, the frame is done. Errors: "io-write".
Result<void> limit(const Job& job,
                   const std::vector<PieceState>& states,
                   std::vector<Addition>& additions) {
    if (job.max_cpu_s <= 0 && job.max_wall_s <= 0) return {};
    const Spent spent = spent_of(job, states);
    double needed_cpu_s = 0;
    for (const Addition& a : additions)
        needed_cpu_s += spent.frame_cpu_s[a.frame] * double(a.end - a.first) /
                        double(std::max<uint64_t>(a.first, 1));
    if (needed_cpu_s <= 0) return {};
    double share = 1;
    const char* which = "";
    const auto take = [&](double left_s, double needed_s, const char* name) {
        if (left_s >= share * needed_s) return;
        share = std::max(left_s / needed_s, 0.0);
        which = name;
    };
    if (job.max_cpu_s > 0) take(job.max_cpu_s - spent.cpu_s, needed_cpu_s, "--max-cpu");
    // As many machines as before
    if (job.max_wall_s > 0 && spent.cpu_s > 0)
        take(job.max_wall_s - spent.wall_s, needed_cpu_s * spent.wall_s / spent.cpu_s,
             "--max-time");
    if (share >= 1) return {};
    for (Addition& a : additions) {
        const auto samples = uint64_t(double(a.end - a.first) * share);
        a.end = a.first + samples;
        if (samples >= std::max<uint64_t>(1, a.first / 16)) continue;
        a.end = a.first;
        if (!a.result) continue;
        a.result->limit = which;
        if (const auto ok = write_result(job, a.frame, *a.result); !ok) return ok.error();
    }
    std::erase_if(additions, [](const Addition& a) { return a.end == a.first; });
    return {};
}

/// As split_samples from sample 0, but for the first range: it is to have more than the pilot
/// samples of adaptive sampling, for with its rates the others need not trace them.
std::vector<Piece> split_frame(uint64_t end, uint64_t count) {
    constexpr uint64_t first_end = pilot_samples + pilot_samples / 2;
    std::vector<Piece> pieces = split_samples(0, end, count);
    if (pieces.size() < 2 || pieces[0].end > pilot_samples || end < 2 * first_end) return pieces;
    const std::vector<Piece> others = split_samples(first_end, end, pieces.size() - 1);
    pieces = {{0, 0, first_end}};
    pieces.insert(pieces.end(), others.begin(), others.end());
    return pieces;
}

/// The ranges of samples that a frame gets.
void split(const Job& job,
           const std::vector<PieceState>& states,
           const Addition& a,
           std::vector<Piece>& pieces) {
    uint64_t end = a.end, count = job.ranges;
    if (job.piece_time_s > 0) {
        const FrameCost cost = expected_cost(job, states, a.frame).value_or(FrameCost{});
        count = range_count(cost, end - a.first, job.piece_time_s, job.max_start_share);
        // Of a frame that takes several pieces the first one is to find the rates for the others
        if (a.first == 0 && count > 1 && end >= 2 * first_samples) {
            end = first_samples;
            count = 1;
        }
    } else if (count == 0) {
        count = default_pieces(end - a.first, job.frames.size());
    }
    for (Piece piece :
         a.first == 0 ? split_frame(end, count) : split_samples(a.first, end, count)) {
        piece.frame = a.frame;
        pieces.push_back(piece);
    }
}

}  // namespace

std::vector<Piece> first_round(const Job& job) {
    std::vector<Piece> pieces;
    const size_t frames = job.frames.size();
    for (size_t frame = 0; frame < frames; ++frame) {
        const bool is_measured = job.piece_time_s > 0;
        const bool is_probe = frame == 0 || frame == frames / 2 || frame + 1 == frames;
        if (is_measured && job.target_error <= 0 && !is_probe) continue;
        const uint64_t count = is_measured      ? 1
                               : job.ranges > 0 ? job.ranges
                                                : default_pieces(job.spp, frames);
        const uint64_t end = is_measured && job.spp >= 2 * first_samples ? first_samples : job.spp;
        for (Piece piece : split_frame(end, count)) {
            piece.frame = frame;
            pieces.push_back(piece);
        }
    }
    return pieces;
}

double error_by_rounds(const std::vector<ErrorAt>& errors) {
    // The power lies between -0.5 and -0.75
    constexpr double power = 0.6, power_deviation = 0.07, quantile = 1.96;
    const ErrorAt& last = errors.back();
    double weights = 0, sum = 0;
    for (const ErrorAt& e : errors) {
        if (!(e.low > 0 && e.high > e.low && e.error > 0)) continue;
        // Images that share most of their samples say the same again
        if (&e != &last && 3 * e.spp > 2 * last.spp) continue;
        const double further = std::log(double(last.spp) / double(e.spp));
        const double deviation = std::log(e.high / e.low) / (2 * quantile);
        const double weight = 1 / (deviation * deviation + std::pow(power_deviation * further, 2));
        weights += weight;
        sum += weight * (std::log(e.error) - power * further);
    }
    return last.low > 0 && weights > 0 ? std::exp(sum / weights) : last.error;
}

bool needs_samples(const Job& job, const FrameResult& result) {
    if (job.target_error <= 0 || !result.has_error() || !result.limit.empty()) return false;
    return error_by_rounds(result.errors) > job.target_error &&
           result.errors.back().spp < job.max_spp;
}

uint64_t next_spp(const Job& job, const FrameResult& result) {
    constexpr double most = 4;
    const ErrorAt& last = result.errors.back();
    const double ratio = std::min(most, std::pow(error_by_rounds(result.errors) / job.target_error,
                                                 1 / slope_of(result.errors)));
    const double wanted = double(last.spp) * ratio;
    const uint64_t unit = std::max<uint64_t>(1, std::bit_floor(uint64_t(wanted)) / 16);
    const uint64_t spp = (uint64_t(std::ceil(wanted)) + unit - 1) / unit * unit;
    // Each round costs the start of its pieces and a merge
    const uint64_t least = std::max<uint64_t>(1, last.spp / 8);
    return std::min(std::max(spp, last.spp + least), job.max_spp);
}

Result<bool> lacks_pieces(const Job& job, const std::vector<PieceState>& states) {
    const Result<std::vector<Addition>> additions = wanted(job, states);
    if (!additions) return additions.error();
    return !additions->empty();
}

Result<std::vector<size_t>> add_round(Job& job) {
    const Result<std::vector<PieceState>> states = read_pieces(job);
    if (!states) return states.error();
    Result<std::vector<Addition>> additions = wanted(job, *states);
    if (!additions) return additions.error();
    if (const auto ok = limit(job, *states, *additions); !ok) return ok.error();
    std::vector<Piece> pieces;
    for (const Addition& a : *additions) split(job, *states, a, pieces);
    std::vector<size_t> numbers;
    if (pieces.empty()) return numbers;
    const size_t had = job.pieces.size();
    if (const auto ok = add_pieces(job, pieces); !ok) return ok.error();
    for (size_t i = had; i < job.pieces.size(); ++i) numbers.push_back(i);
    return numbers;
}

}  // namespace velatura::farm
