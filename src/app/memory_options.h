// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <functional>
#include <string>

namespace velatura::app {

/// Adds --memory-limit; its text goes to run_in_memory.
Option add_memory_option(Command& command, std::string& limit);

/// Does the work while the process keeps below the limit, as typed; empty = none.
/// Returns: what the work returns, UsageError for what is no size, MemoryReached, with a message on
/// stderr, when the limit does not allow it.
int run_in_memory(const std::string& limit, const std::function<int()>& work);

}  // namespace velatura::app
