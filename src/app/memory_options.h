// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace velatura::app {

/// Adds --memory-limit; its text goes to run_in_memory.
void add_memory_option(CLI::App& command, std::string& limit);

/// Does the work while the process keeps below the limit, as typed; empty = none.
/// Returns: what the work returns, UsageError for what is no size, MemoryReached, with a message on
/// stderr, when the limit does not allow it.
int run_in_memory(const std::string& limit, const std::function<int()>& work);

}  // namespace velatura::app
