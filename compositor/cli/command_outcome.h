// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>

namespace velatura::compositor::cli {

/// Exit codes, docs/reference/command_line.md.
enum ExitCode { done = 0, failed = 1, usage = 2, partly = 3, check_failed = 4, refused = 5 };

/// Prints the error. Returns: the exit code that its code stands for.
int report(const Error& error);

void warn(const std::string& message);

}  // namespace velatura::compositor::cli
