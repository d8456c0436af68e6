// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::plugins::openimageio {

/// A message of OpenImageIO without the line breaks that it ends and divides some with.
inline std::string one_line(std::string text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    for (char& c : text) {
        if (c == '\n') c = ' ';
    }
    return text;
}

}  // namespace velatura::plugins::openimageio
