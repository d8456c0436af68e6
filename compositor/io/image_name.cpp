// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/image_name.h"

#include "image/formats.h"

#include <algorithm>
#include <cctype>

namespace velatura::compositor {
inline namespace io {

bool is_display_image(const std::string& path) {
    return image::display_format(path) != nullptr;
}

bool is_exr(const std::string& path) {
    std::string lower = path;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return lower.ends_with(".exr");
}

std::string image_names() {
    std::string names = ".exr";
    for (const image::DisplayFormat& format : image::display_formats) {
        names += &format == &image::display_formats.back() ? " or " : ", ";
        names += format.extension;
    }
    return names;
}

}  // namespace io
}  // namespace velatura::compositor
