// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <functional>

namespace velatura::compositor::cli {

/// Each adds its subcommand and sets `run` when the command line asks for it. `run` returns an exit
/// code.
void add_info_command(Command& app, std::function<int()>& run);
void add_mix_command(Command& app, std::function<int()>& run);
void add_noise_command(Command& app, std::function<int()>& run);
void add_request_command(Command& app, std::function<int()>& run);
void add_ui_command(Command& app, std::function<int()>& run);
void add_verify_command(Command& app, std::function<int()>& run);
void add_diff_command(Command& app, std::function<int()>& run);
void add_merge_command(Command& app, std::function<int()>& run);
void add_mattes_command(Command& app, std::function<int()>& run);
void add_view_command(Command& app, std::function<int()>& run);
void add_export_command(Command& app, std::function<int()>& run);
void add_bake_command(Command& app, std::function<int()>& run);
void add_denoise_command(Command& app, std::function<int()>& run);
void add_preset_command(Command& app, std::function<int()>& run);

}  // namespace velatura::compositor::cli
