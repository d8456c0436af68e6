// SPDX-License-Identifier: Apache-2.0
#include "app/memory_options.h"

#include "app/exit_codes.h"
#include "app/parse_values.h"
#include "app/progress.h"
#include "base/process/memory_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

namespace velatura::app {

Option add_memory_option(Command& command, std::string& limit) {
    return command
        .add_option("--memory-limit", limit,
                    "Memory limit, e.g. 8G, 800M or 50% of the machine's: exit code 6 if the scene "
                    "does not fit, exit code 3 with a valid file if a render reaches it")
        .type_name("SIZE")
        .not_empty();
}

int run_in_memory(const std::string& limit, const std::function<int()>& work) {
    if (limit.empty()) return work();
    const Result<size_t> bytes = parse_size(limit, machine_bytes());
    if (!bytes) {
        fmt::print(stderr, "error: --memory-limit: {} [{}]\n", bytes.error().message,
                   bytes.error().code);
        return UsageError;
    }
    try {
        const MemoryLimit limited(*bytes);
        return work();
    } catch (const std::bad_alloc&) {
        // What was in use has been given back by now, but for the kernel's own count
        const size_t used = peak_resident_bytes(), asked = MemoryLimit::refused_bytes();
        fmt::print(stderr,
                   "error: --memory-limit: {} is too low: {} in use and {} requested {}; at least "
                   "{} needed [memory-limit]\n",
                   format_bytes(*bytes), format_bytes(used),
                   asked > 0 ? format_bytes(asked) + " more" : "more", MemoryLimit::doing(),
                   format_bytes(std::max(*bytes, used + asked + MemoryLimit::kept_bytes)));
        return MemoryReached;
    }
}

}  // namespace velatura::app
