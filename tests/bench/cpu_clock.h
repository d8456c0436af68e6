// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

namespace velatura::bench {

/// CPU time of the process so far, of all its threads, in seconds.
inline double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace velatura::bench
