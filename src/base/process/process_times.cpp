// SPDX-License-Identifier: Apache-2.0
#include "base/process/process_times.h"

#include <sys/resource.h>

#include <chrono>

namespace velatura {
inline namespace process {

namespace {

using Clock = std::chrono::steady_clock;

// Set while the program is loaded, before main()
const Clock::time_point start = Clock::now();

double seconds_of(const timeval& t) {
    return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
}

}  // namespace

ProcessTimes process_times() {
    ProcessTimes times;
    times.wall_s = std::chrono::duration<double>(Clock::now() - start).count();
    for (const __rusage_who who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage used{};
        if (::getrusage(who, &used) == 0)
            times.cpu_s += seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
    }
    return times;
}

}  // namespace process
}  // namespace velatura
