// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <vector>

namespace velatura {

/// Replaces this process by the program `name` in its folder. Returns only where that fails.
/// Args:    arguments: without the program's name.
///          missing: what a message says after `NAME not found beside PROGRAM; `.
/// Errors:  "no-window".
Error run_sibling(const std::string& name,
                  const std::vector<std::string>& arguments,
                  const std::string& missing);

}  // namespace velatura
