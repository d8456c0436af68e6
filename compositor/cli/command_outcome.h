// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace velatura::compositor::cli {

/// Exit codes, docs/reference/command_line.md.
enum ExitCode { done = 0, failed = 1, usage = 2, partly = 3, check_failed = 4, refused = 5 };

/// Prints the error. Returns: the exit code that its code stands for.
int report(const Error& error);

/// Warnings of many frames, which differ only in the file before the first colon, are counted.
class RepeatedWarnings {
  public:
    static constexpr size_t printed_limit = 20;

    /// Counts the warning. Returns: whether it is one of the first.
    bool can_print(const std::string& message);
    /// Whole lines: how many of each were not printed. Forgets all of them.
    std::string take_summary();

  private:
    std::mutex mutex_;
    std::map<std::string, size_t> counts_;
};

/// Prints a warning, if it is one of the first of its kind.
void warn(const std::string& message);

/// At the end of a command: prints how many warnings of each kind were not printed.
void end_warnings();

}  // namespace velatura::compositor::cli
