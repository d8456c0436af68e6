// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

namespace velatura::bench {

inline double seconds_of(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// CPU time of the process so far, of all its threads, in seconds.
inline double cpu_seconds() {
    return seconds_of(CLOCK_PROCESS_CPUTIME_ID);
}

/// CPU time of this thread so far, in seconds.
inline double thread_seconds() {
    return seconds_of(CLOCK_THREAD_CPUTIME_ID);
}

}  // namespace velatura::bench
