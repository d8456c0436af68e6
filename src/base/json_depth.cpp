// SPDX-License-Identifier: Apache-2.0
#include "base/json_depth.h"

#include <cstddef>

namespace velatura {

bool is_json_too_deep(std::string_view text) {
    int depth = 0;
    bool is_in_string = false;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (is_in_string) {
            // What follows a backslash does not end the string
            if (c == '\\') ++i;
            is_in_string = c != '"';
        } else if (c == '"') {
            is_in_string = true;
        } else if (c == '[' || c == '{') {
            if (++depth > deepest_json) return true;
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return false;
}

}  // namespace velatura
