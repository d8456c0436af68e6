// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_arguments.h"
#include "base/command_line.h"

#include <string>
#include <vector>

namespace velatura::app {

/// The command line of `velatura view`, which its window's program reads as well.
struct ViewOptions {
    RenderArguments render;
    std::string preset, script, edits;
    std::vector<int> size = {1600, 960};
    bool prints_times = false;
};

/// Declares the options on a command; the strings are the text of --help.
void declare_view_options(Command& command, ViewOptions& options);

}  // namespace velatura::app
