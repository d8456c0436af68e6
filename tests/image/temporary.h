// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::image {

/// Path of a file in a folder that goes away with the process; ctest runs tests side by side.
std::string temporary(const std::string& name);

}  // namespace velatura::image
