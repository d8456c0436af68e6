// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>

namespace velatura {

/// Keeps this program from writing over the files that it reads. Files are told apart by device and
/// inode: a link of any kind is the file that it leads to. For all threads.

/// Starts anew with no file: from here on write_atomically refuses every file that guard_input
/// names. Without it, and after stop_guarding_inputs, it writes whatever it is given.
void start_guarding_inputs();
void stop_guarding_inputs();

/// A file that is read, whether it is there or not. Only regular files are guarded.
void guard_input(const std::string& path);

/// Whether a file may be written. Errors: "overwrites-input", which names both.
Result<void> check_output(const std::string& path);

}  // namespace velatura
