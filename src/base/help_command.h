// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <functional>
#include <span>
#include <string_view>

namespace velatura {

/// A page of `help TOPIC`.
struct HelpTopic {
    std::string_view name;
    std::string_view summary;
    std::string_view text;  ///< whole lines, at most 60 of at most 100 columns
};

/// Adds the command `help`, which gives `end` a topic or the help of a command that was added
/// before it, or, where there is no such page, code 2 and what there is. Sets `run` when the
/// command line asks for it; `run` returns what `end` does. `app`, `run` and what the topics refer
/// to must outlive the run.
Command add_help_command(CommandLine& app,
                         std::function<int()>& run,
                         std::span<const HelpTopic> topics,
                         std::function<int(const CommandExit&)> end);

}  // namespace velatura
