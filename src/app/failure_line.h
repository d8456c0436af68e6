// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/exit_codes.h"
#include "base/result.h"

#include <string>

namespace velatura::app {

/// For --progress openjd: from here on note_error() keeps what print_failure() prints.
void keep_failures();

/// An error message that was printed, without "error:". Thread-safe.
void note_error(const std::string& message);

/// Prints "error: MESSAGE [CODE]" and notes it. Returns: UsageError for "usage", else `code`.
int fail(const Error& error, int code = RenderError);

/// Prints "openjd_fail: MESSAGE" for the last error, as Open Job Description has it, or the meaning
/// of the exit code where no error was printed. Nothing for exit code 0 and without
/// keep_failures().
void print_failure(int code);

}  // namespace velatura::app
