// SPDX-License-Identifier: Apache-2.0
#include "compositor/picture_name.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

namespace velatura::compositor {

namespace {

bool ends_with_any(const std::string& path, std::initializer_list<const char*> extensions) {
    std::string lower = path;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const char* e) { return lower.ends_with(e); });
}

}  // namespace

bool is_display_picture(const std::string& path) {
    return ends_with_any(path, {".png", ".jpg", ".jpeg"});
}

bool is_exr(const std::string& path) {
    return ends_with_any(path, {".exr"});
}

}  // namespace velatura::compositor
