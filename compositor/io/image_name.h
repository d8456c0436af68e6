// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::compositor {
inline namespace io {

/// What the end of a file's name, in capitals or not, says of the image in it.
bool is_display_image(const std::string& path);  ///< one of image::display_formats
bool is_exr(const std::string& path);

/// What an image's name may end in, for messages: ".exr, .png … or .dpx".
std::string image_names();

}  // namespace io
}  // namespace velatura::compositor
