// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <cstdio>
#include <optional>

namespace velatura::bench {

/// Parses, and prints why the bench ends when it is not to run. Returns: its exit code, if it ends.
inline std::optional<int> parse_options(CommandLine& line, int argc, const char* const* argv) {
    const std::optional<CommandExit> ended = line.parse(argc, argv);
    if (!ended) return std::nullopt;
    std::fputs(ended->text.c_str(), ended->code == 0 ? stdout : stderr);
    return ended->code;
}

}  // namespace velatura::bench
