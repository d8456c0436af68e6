// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstddef>
#include <functional>
#include <string>

namespace velatura {

struct IsolationLimits {
    size_t cpu_seconds = 60;
    size_t wall_seconds = 600;               ///< for those that wait rather than compute
    size_t address_bytes = size_t(8) << 30;  ///< not enforced under sanitizers
};

/// Runs `work` in a child process and returns its bytes: what it does to memory, and how long it
/// takes, cannot harm this one. It ends when this process, or the calling thread, does. Errors:
/// "isolated-timeout" (CPU or wall limit), "isolated-crashed".
Result<std::string> run_isolated(const IsolationLimits& limits,
                                 const std::function<std::string()>& work);

}  // namespace velatura
