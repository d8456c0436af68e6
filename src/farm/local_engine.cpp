// SPDX-License-Identifier: Apache-2.0
#include "farm/local_engine.h"

#include "base/output_lock.h"
#include "farm/merge_job.h"
#include "farm/preview.h"
#include "farm/rounds.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace velatura::farm {

namespace {

/// The pieces of a job between the threads that run them.
class Queue {
  public:
    Queue(const Job& job, const LocalOptions& options, std::vector<PieceState> states)
        : job_(job), options_(options), states_(std::move(states)), is_taken_(states_.size()) {}

    Result<void> run() {
        const size_t slots = std::min(size_t(std::max(job_.slots, 1)), states_.size());
        {
            std::vector<std::jthread> threads;
            for (size_t i = 0; i < slots; ++i) threads.emplace_back([this] { work(); });
        }
        if (failure_) return *failure_;
        return {};
    }

  private:
    bool is_to_stop() const { return options_.run.is_to_stop && options_.run.is_to_stop(); }

    bool is_open(size_t piece) const {
        const State s = states_[piece].state;
        return !is_taken_[piece] && s != State::Done && s != State::GaveUp;
    }

    void work() {
        for (;;) {
            size_t piece = 0;
            {
                const std::scoped_lock lock(mutex_);
                if (failure_ || is_to_stop()) return;
                // Those that failed come last
                std::optional<size_t> next;
                for (size_t i = 0; i < states_.size(); ++i)
                    if (is_open(i) && (!next || states_[i].failures < states_[*next].failures))
                        next = i;
                if (!next) return;
                piece = *next;
                is_taken_[piece] = true;
            }
            if (!keep(piece, run_piece(job_, piece, options_.run))) return;
            // Beside the other pieces; what it cannot read, they report
            (void)renew_preview(job_, job_.pieces[piece].frame);
        }
    }

    /// Returns: false to end this thread.
    bool keep(size_t piece, Result<PieceState> state) {
        const std::scoped_lock lock(mutex_);
        is_taken_[piece] = false;
        if (!state) {
            if (!failure_) failure_ = state.error();
            return false;
        }
        states_[piece] = std::move(*state);
        if (options_.on_piece) options_.on_piece(job_, piece, states_[piece]);
        if (states_[piece].state == State::Done) merge(job_.pieces[piece].frame);
        return true;
    }

    void merge(size_t frame) {
        const std::vector<size_t> pieces = job_.pieces_of(frame);
        const bool is_done = std::all_of(pieces.begin(), pieces.end(),
                                         [&](size_t i) { return states_[i].state == State::Done; });
        if (!is_done) return;
        const auto merged = merge_frame(job_, frame);
        if (!merged) {
            if (!failure_) failure_ = merged.error();
            return;
        }
        if (*merged) return;
        // Damaged parts: their pieces are not done any more
        for (const size_t i : pieces) {
            Result<PieceState> state = read_piece(job_, i);
            if (!state) {
                failure_ = state.error();
                return;
            }
            if (state->state != State::Done && options_.on_piece)
                options_.on_piece(job_, i, *state);
            states_[i] = std::move(*state);
        }
    }

    const Job& job_;
    const LocalOptions& options_;
    std::mutex mutex_;
    std::vector<PieceState> states_;
    std::vector<bool> is_taken_;
    std::optional<Error> failure_;
};

}  // namespace

Result<void> run_local(Job job, const LocalOptions& options) {
    const Result<OutputLock> lock = OutputLock::take(job.path("job.json"));
    if (!lock) return lock.error();
    // Frames whose parts were there already
    if (const Result<void> merged = merge_frames(job); !merged) return merged;
    for (;;) {
        Result<std::vector<PieceState>> states = read_pieces(job);
        if (!states) return states.error();
        const Result<void> ran = Queue(job, options, std::move(*states)).run();
        if (!ran || (options.run.is_to_stop && options.run.is_to_stop())) return ran;
        const auto round = add_round(job);
        if (!round) return round.error();
        if (round->empty()) return {};
        if (options.on_round) options.on_round(job, *round);
    }
}

}  // namespace velatura::farm
