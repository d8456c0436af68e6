// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura {

/// Limits the parallel_for calls of the calling thread, and those within them, to `threads` threads
/// while it lives; 0 = all cores. Other threads of the process keep theirs, unlike with a
/// ThreadLimit, which must not live at the same time. Belongs to the thread that made it.
class ThreadScope {
  public:
    explicit ThreadScope(int threads);
    ~ThreadScope();
    ThreadScope(const ThreadScope&) = delete;
    ThreadScope& operator=(const ThreadScope&) = delete;

  private:
    void* control_;
};

}  // namespace velatura
