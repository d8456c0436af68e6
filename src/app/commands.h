// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace velatura::app {

/// Each adds its subcommand and sets `run` when the command line asks for it. `run` returns an exit
/// code.
void add_render_command(CLI::App& app, std::function<int()>& run);
void add_study_command(CLI::App& app, std::function<int()>& run);
void add_selftest_command(CLI::App& app, std::function<int()>& run);
void add_plan_command(CLI::App& app, std::function<int()>& run);
void add_info_command(CLI::App& app, std::function<int()>& run);
void add_flatten_command(CLI::App& app, std::function<int()>& run);
void add_import_command(CLI::App& app, std::function<int()>& run);

}  // namespace velatura::app
