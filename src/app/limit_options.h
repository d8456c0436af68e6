// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "base/limits.h"

namespace velatura::app {

/// Adds --limit NAME=VALUE, which may come several times, for what files may ask for.
void add_limit_option(Command& command, Limits& limits);

}  // namespace velatura::app
