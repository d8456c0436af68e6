// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace velatura::app {

/// Exit codes of every command; docs/reference/command_line.md has the same table.
enum ExitCode : int {
    Done = 0,
    RenderError = 1,  ///< scene, input/output or render error; a missing asset
    UsageError = 2,
    TargetMissed = 3,   ///< incomplete, the file is valid: --require-target, the memory limit
    CheckFailed = 4,    ///< numeric or closure check failed
    Refused = 5,        ///< the file is no part of this render, or another process renders to it
    MemoryReached = 6,  ///< the memory limit does not allow it; nothing was written
    SignalBase = 128,   ///< 128 + n after signal n
};

struct ExitCodeInfo {
    int code;
    std::string_view name;     ///< as typed: "0", "128+n"
    std::string_view meaning;  ///< no comma before a digit: man pages split there
    int rank;                  ///< of several codes the highest rank is returned
};

/// By code. A code that says more about what is wrong with the image outranks one that says less.
inline constexpr ExitCodeInfo exit_code_table[] = {
    {Done, "0", "done: the target was reached or the budget used", 0},
    {RenderError, "1", "scene, file or render error, or a missing asset", 2},
    {UsageError, "2", "usage", 6},
    {TargetMissed, "3", "target missed (--require-target) or stopped by the memory limit", 1},
    {CheckFailed, "4", "check failed", 3},
    {Refused, "5", "resume refused or output taken by another render", 4},
    {MemoryReached, "6", "memory limit too low", 5},
    {SignalBase, "128+n", "stopped by signal n", 7},
};

/// Of two results of one command, that which it returns: of the table the one with the higher rank,
/// of two of one rank the first.
constexpr int worse_exit_code(int first, int second) {
    const auto rank = [](int code) {
        if (code > SignalBase) code = SignalBase;
        for (const ExitCodeInfo& info : exit_code_table)
            if (info.code == code) return info.rank;
        return 0;
    };
    return rank(second) > rank(first) ? second : first;
}

/// "Exit codes: 0 done, 1 …": the last line of --help.
inline std::string exit_codes_text() {
    std::string text = "Exit codes:";
    for (const ExitCodeInfo& info : exit_code_table) {
        text += text.back() == ':' ? " " : ", ";
        text += std::string(info.name) + " " + std::string(info.meaning);
    }
    return text;
}

}  // namespace velatura::app
