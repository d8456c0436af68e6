// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace velatura {

/// Exit code of a wrong command line.
inline constexpr int usage_error = 2;

/// Subcommands that have a name: groups of options have none, and hidden ones no group.
std::vector<const CLI::App*> named_subcommands(const CLI::App& app);

/// Whether a word of a command line is an option, and no negative number.
bool is_option_word(const std::string& word);

/// The end of a program whose command line is wrong: exit code 2, with the program's name as
/// called.
CommandExit usage_exit(const CLI::App& app, const std::string& problem);

/// The same of what the parser found, in terms of what was meant; exit code 0 for a help page.
CommandExit exit_of(const CLI::App& app, const CLI::ParseError& error);

}  // namespace velatura
