// SPDX-License-Identifier: Apache-2.0
#include "base/process/process_limits.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace velatura {
inline namespace process {

size_t address_bytes() {
    size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    return pages * size_t(sysconf(_SC_PAGESIZE));
}

void set_limit(__rlimit_resource resource, size_t value) {
    rlimit limit = {};
    if (getrlimit(resource, &limit) != 0) return;
    limit.rlim_cur =
        limit.rlim_max == RLIM_INFINITY ? rlim_t(value) : std::min(rlim_t(value), limit.rlim_max);
    setrlimit(resource, &limit);
}

}  // namespace process
}  // namespace velatura
