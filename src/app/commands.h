// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <functional>
#include <string>
#include <vector>

namespace velatura::app {

/// Each adds its subcommand and sets `run` when the command line asks for it. `run` returns an exit
/// code.
void add_render_command(Command& app, std::function<int()>& run);
void add_study_command(Command& app, std::function<int()>& run);
void add_selftest_command(Command& app, std::function<int()>& run);
void add_plan_command(Command& app, std::function<int()>& run);
void add_info_command(Command& app, std::function<int()>& run);
void add_flatten_command(Command& app, std::function<int()>& run);
void add_farm_command(Command& app, std::function<int()>& run);
void add_import_command(Command& app, std::function<int()>& run);

/// words: the whole command line, without the program's name.
void add_view_command(Command& app,
                      std::function<int()>& run,
                      const std::vector<std::string>& words);

}  // namespace velatura::app
