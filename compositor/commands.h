// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace velatura::compositor {

/// Each adds its subcommand and sets `run` when the command line asks for it. `run` returns an exit
/// code.
void add_info_command(CLI::App& app, std::function<int()>& run);
void add_mix_command(CLI::App& app, std::function<int()>& run);
void add_noise_command(CLI::App& app, std::function<int()>& run);
void add_plan_command(CLI::App& app, std::function<int()>& run);
void add_ui_command(CLI::App& app, std::function<int()>& run);
void add_verify_command(CLI::App& app, std::function<int()>& run);
void add_diff_command(CLI::App& app, std::function<int()>& run);
void add_merge_command(CLI::App& app, std::function<int()>& run);
void add_view_command(CLI::App& app, std::function<int()>& run);
void add_export_command(CLI::App& app, std::function<int()>& run);
void add_bake_command(CLI::App& app, std::function<int()>& run);
void add_denoise_command(CLI::App& app, std::function<int()>& run);
void add_preset_command(CLI::App& app, std::function<int()>& run);

}  // namespace velatura::compositor
