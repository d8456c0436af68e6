// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"
#include "farm/job.h"

#include <functional>

namespace velatura::app {

/// Declares `farm submit`, with the options of a render. `start` gives a new job to its engine and
/// returns the exit code; its second argument: print errors only.
void add_farm_submit(Command farm,
                     std::function<int()>& run,
                     const std::function<int(const farm::Job&, bool)>& start);

}  // namespace velatura::app
