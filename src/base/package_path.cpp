// SPDX-License-Identifier: Apache-2.0
#include "base/package_path.h"

namespace velatura {

namespace {

bool is_bracket(char c) {
    return c == '[' || c == ']';
}

bool is_escaped(std::string_view text, size_t at) {
    return at > 0 && text[at - 1] == '\\';
}

/// Place of the bracket that the last character closes; npos when there is none.
size_t opening_bracket(std::string_view text) {
    if (text.empty() || text.back() != ']' || is_escaped(text, text.size() - 1)) {
        return std::string_view::npos;
    }
    size_t depth = 0;
    for (size_t at = text.size(); at-- > 0;) {
        if (!is_bracket(text[at]) || is_escaped(text, at)) continue;
        if (text[at] == ']') {
            ++depth;
        } else if (--depth == 0) {
            return at;
        }
    }
    return std::string_view::npos;
}

std::string unescaped(std::string_view text) {
    std::string result;
    for (size_t at = 0; at < text.size(); ++at) {
        if (text[at] == '\\' && at + 1 < text.size() && is_bracket(text[at + 1])) continue;
        result += text[at];
    }
    return result;
}

}  // namespace

std::vector<std::string> split_package_path(std::string_view name) {
    std::vector<std::string> parts;
    while (true) {
        const bool is_packaged = !parts.empty();
        const size_t open =
            parts.size() > max_package_depth ? std::string_view::npos : opening_bracket(name);
        const std::string_view head = name.substr(0, open);
        parts.push_back(is_packaged ? unescaped(head) : std::string(head));
        if (open == std::string_view::npos) return parts;
        name = name.substr(open + 1, name.size() - open - 2);
    }
}

std::string join_package_path(std::span<const std::string> parts) {
    if (parts.empty()) return {};
    std::string name = parts[0];
    for (const std::string& part : parts.subspan(1)) {
        name += '[';
        for (const char c : part) {
            if (is_bracket(c)) name += '\\';
            name += c;
        }
    }
    return name.append(parts.size() - 1, ']');
}

bool is_package_path(std::string_view name) {
    return opening_bracket(name) != std::string_view::npos;
}

}  // namespace velatura
