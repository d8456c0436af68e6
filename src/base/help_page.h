// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace velatura {

/// What the help prints of an option beside its names and its description.
struct OptionHelp {
    std::string value;  ///< placeholder as typed, e.g. "N" or "{on,off}"; empty: by its type
    std::string default_value;  ///< empty: not printed
    std::string range;          ///< e.g. "1 to 64"; empty: not printed
    bool is_repeatable = false;
    bool is_common = false;                 ///< in --help; the others only in --help-all
    std::vector<std::string> former_names;  ///< "--resumable": not printed
};

/// What stands below the options of a command.
struct CommandHelp {
    std::string example;  ///< command lines; empty: not printed
};

/// Of options that no help lists. CLI11 takes an empty group for that, and then has no name for
/// them in its messages.
inline constexpr const char* hidden_group = "hidden";
bool is_hidden(const CLI::Option& option);

/// Help page of a command. Options stand under the heading of their group, `text [default: 64; 1 to
/// 4096; repeatable]`, those that print help or the version under a heading of their own at the
/// end. Lines are at most 92 columns long, unless a word is longer.
/// Args:    name: as called, with subcommands; is_complete: all options (--help-all), else the
///          common ones where any is.
std::string help_page(const CLI::App& command,
                      const std::string& name,
                      bool is_complete,
                      const CommandHelp& below,
                      const std::function<OptionHelp(const CLI::Option*)>& help_of);

}  // namespace velatura
