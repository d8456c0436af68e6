// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::farm {

struct ProcessRequest {
    std::vector<std::string> arguments;  ///< the program first, found as a shell finds it
    std::string directory;               ///< empty: that of this process
    std::string log;                     ///< file to append to what it prints; empty: none
    /// Each line that it prints, without its end.
    std::function<void(std::string_view line)> on_line;
    /// Called some times a second. Returns: true once, to stop the process by SIGTERM.
    std::function<bool()> is_to_stop;
    std::function<void(int process)> on_start;
};

struct ProcessResult {
    int code = 0;            ///< exit code; 128 + n after signal n
    bool is_killed = false;  ///< by a signal that it did not handle
    double wall_s = 0, cpu_s = 0;
    uint64_t peak_bytes = 0;
};

/// Runs a program to its end. It gets SIGTERM if the calling thread ends before it. Errors:
/// "farm-process" (no process can be made, the log cannot be written); a program that is not found
/// ends with code 127.
Result<ProcessResult> run_process(const ProcessRequest& request);

std::string host_name();

/// The program of this process; empty where the system does not name it.
std::string own_program();

/// The compositor beside this program, else that of $PATH.
std::string compositor_program();

}  // namespace velatura::farm
