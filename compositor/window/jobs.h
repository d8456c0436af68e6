// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <chrono>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <new>
#include <optional>
#include <utility>

namespace velatura::compositor::window {

/// What is thrown becomes an error: a file that does not fit into memory must not end the window.
/// Errors: those of the work; "out-of-memory", "failed".
template <class T>
Result<T> guarded(const std::function<Result<T>()>& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Error{"out-of-memory", "out of memory"};
    } catch (const std::exception& e) {
        return Error{"failed", e.what()};
    }
}

/// Jobs of one kind, done in the background one after the other, so that asking for one more never
/// waits for those before. Of one thread, but for the jobs themselves.
template <class T>
class Jobs {
  public:
    using Work = std::function<Result<T>()>;

    /// `wake` is called from the job's thread whenever one has ended.
    explicit Jobs(std::function<void()> wake) : wake_(std::move(wake)) {}

    /// After all others.
    void add(Work work) {
        waiting_.push_back(std::move(work));
        begin_next();
    }

    /// In place of all others: what the one under way brings is dropped.
    void replace(Work work) {
        waiting_.clear();
        is_dropped_ = running_.has_value();
        add(std::move(work));
    }

    /// Nothing more comes of those so far.
    void drop() {
        waiting_.clear();
        is_dropped_ = running_.has_value();
    }

    /// What came of the oldest job that has ended and was not taken.
    std::optional<Result<T>> take() {
        if (!running_ || running_->wait_for(std::chrono::seconds(0)) != std::future_status::ready)
            return std::nullopt;
        std::optional<Result<T>> outcome = running_->get();
        running_.reset();
        if (std::exchange(is_dropped_, false)) outcome.reset();
        begin_next();
        return outcome;
    }

    bool is_busy() const { return running_.has_value(); }

  private:
    void begin_next() {
        if (running_ || waiting_.empty()) return;
        running_ =
            std::async(std::launch::async, [wake = wake_, work = std::move(waiting_.front())] {
                Result<T> outcome = guarded(work);
                wake();
                return outcome;
            });
        waiting_.pop_front();
    }

    std::function<void()> wake_;
    std::deque<Work> waiting_;
    std::optional<std::future<Result<T>>> running_;
    bool is_dropped_ = false;
};

}  // namespace velatura::compositor::window
