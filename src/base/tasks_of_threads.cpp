// SPDX-License-Identifier: Apache-2.0
// tasks.h on std::thread, for ThreadSanitizer (VELATURA_TASKS=threads): it does not see how
// oneTBB's binary, which is built without it, hands work over, and takes every hand-over for a
// race. Threads are made for each loop, and loops within loops run on the thread that meets them;
// tests of this file are those of tasks.h.
#include "base/tasks.h"
#include "base/thread_scope.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace velatura {

namespace {

std::atomic<int>& limit() {
    static std::atomic<int> threads = 0;  // 0: all cores
    return threads;
}

/// Of a ThreadScope; 0: none.
thread_local int limit_of_thread = 0;
thread_local bool is_within_loop = false;

int core_count() {
    return std::max(1, int(std::thread::hardware_concurrency()));
}

/// Indices of one loop, taken by whichever thread is free.
class Loop {
  public:
    Loop(size_t count, const std::function<void(size_t)>& body, size_t grain)
        : count_(count), body_(body), grain_(grain) {}

    /// Until none are left, or a body has thrown.
    void work() {
        is_within_loop = true;
        try {
            for (size_t begin; (begin = next_.fetch_add(grain_)) < count_;)
                for (size_t i = begin; i < std::min(begin + grain_, count_); ++i) body_(i);
        } catch (...) {
            next_ = count_;
            std::lock_guard lock(mutex_);
            if (!thrown_) thrown_ = std::current_exception();
        }
        is_within_loop = false;
    }

    void rethrow() const {
        if (thrown_) std::rethrow_exception(thrown_);
    }

  private:
    size_t count_;
    const std::function<void(size_t)>& body_;
    size_t grain_;
    std::atomic<size_t> next_ = 0;
    std::mutex mutex_;
    std::exception_ptr thrown_;
};

}  // namespace

ThreadLimit::ThreadLimit(int threads) {
    control_ = new int(limit().exchange(threads > 0 ? threads : core_count()));
}

ThreadLimit::~ThreadLimit() {
    int* const outer = static_cast<int*>(control_);
    limit() = *outer;
    delete outer;
}

ThreadScope::ThreadScope(int threads) {
    control_ = new int(limit_of_thread);
    limit_of_thread = threads > 0 ? threads : core_count();
}

ThreadScope::~ThreadScope() {
    int* const outer = static_cast<int*>(control_);
    limit_of_thread = *outer;
    delete outer;
}

int thread_count() {
    const int threads = limit_of_thread > 0 ? limit_of_thread : limit().load();
    return threads > 0 ? threads : core_count();
}

void start_threads() {}

void parallel_for(size_t count, const std::function<void(size_t)>& body, size_t grain) {
    const size_t step = std::max<size_t>(grain, 1);
    const size_t threads = std::min((count + step - 1) / step, size_t(thread_count()));
    if (is_within_loop || threads <= 1) {
        for (size_t i = 0; i < count; ++i) body(i);
        return;
    }
    Loop loop(count, body, step);
    std::vector<std::thread> others;
    for (size_t i = 1; i < threads; ++i) others.emplace_back([&] { loop.work(); });
    loop.work();
    for (std::thread& other : others) other.join();
    loop.rethrow();
}

void parallel_for_isolated(size_t count, const std::function<void(size_t)>& body) {
    parallel_for(count, body);
}

}  // namespace velatura
