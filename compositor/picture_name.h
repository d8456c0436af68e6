// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::compositor {

/// What the end of a file's name, in capitals or not, says of the picture in it.
bool is_display_picture(const std::string& path);  ///< .png, .jpg, .jpeg
bool is_exr(const std::string& path);

}  // namespace velatura::compositor
