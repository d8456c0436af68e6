// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

namespace velatura::plugins::openimageio {

/// How long is left of some seconds of waiting. Time in which this process did not look, because it
/// was stopped, say, counts as one second at most: what it waits for may have been stopped as well.
class Timeout {
  public:
    using Clock = std::chrono::steady_clock;

    explicit Timeout(double seconds) : left_s_(seconds) {}

    /// To be asked again and again.
    bool has_expired() {
        const Clock::time_point now = Clock::now();
        left_s_ -= std::min(std::chrono::duration<double>(now - last_).count(), 1.0);
        last_ = now;
        return left_s_ <= 0;
    }

  private:
    double left_s_;
    Clock::time_point last_ = Clock::now();
};

/// Waits until something can be read, or nobody can send any more. False when timeout is over, or
/// `continues`, which is asked ten times a second, says so.
template <class Continues>
bool wait_to_read(const FileDescriptor& file, Timeout& timeout, const Continues& continues) {
    constexpr int tick_ms = 100;
    for (;;) {
        pollfd end = {.fd = file.get(), .events = POLLIN, .revents = 0};
        const int found = ::poll(&end, 1, tick_ms);
        if (found > 0) return true;
        if (found < 0 && errno != EINTR) return false;
        if (timeout.has_expired() || !continues()) return false;
    }
}

inline bool wait_to_read(const FileDescriptor& file, Timeout& timeout) {
    return wait_to_read(file, timeout, [] { return true; });
}

}  // namespace velatura::plugins::openimageio
