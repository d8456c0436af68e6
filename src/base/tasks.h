// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace velatura {

/// Limits every parallel_for of the process to `threads` threads while it lives; 0 = all cores.
class ThreadLimit {
  public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

  private:
    void* control_;
};

/// Threads that parallel_for may use now.
int thread_count();

/// Starts those threads, which would start one by one when they are first of use.
void start_threads();

/// Calls body(i) once for every i in [0, count), in any order, on the threads allowed; returns when
/// all are done. A std:: exception thrown by body is rethrown here. `grain` indices at least go to
/// one thread at a time.
void parallel_for(size_t count, const std::function<void(size_t)>& body, size_t grain = 1);

/// The same for callers that hold a lock: while it waits, the calling thread takes up nothing but
/// these bodies.
void parallel_for_isolated(size_t count, const std::function<void(size_t)>& body);

}  // namespace velatura
