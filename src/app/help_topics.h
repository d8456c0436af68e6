// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/help_command.h"

#include <span>

namespace velatura::app {

/// The pages of `velatura help TOPIC`.
std::span<const HelpTopic> help_topics();

}  // namespace velatura::app
