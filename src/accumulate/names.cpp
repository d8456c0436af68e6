// SPDX-License-Identifier: Apache-2.0
#include "accumulate/names.h"

#include "base/characters.h"

#include <algorithm>
#include <array>

namespace velatura::accumulate {

namespace {

bool is_name_char(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_';
}

bool is_numeric(std::string_view s) {
    return !s.empty() && std::all_of(s.begin(), s.end(), is_digit);
}

bool is_mixer_word(std::string_view s) {
    constexpr std::array<std::string_view, 6> words = {"all",  "direct", "indirect",
                                                       "tail", "env",    "shadow"};
    if (std::find(words.begin(), words.end(), s) != words.end()) return true;
    return s.size() > 1 && s[0] == 'b' && is_numeric(s.substr(1));
}

}  // namespace

std::string legal_group_name(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const char legal = is_name_char(c) ? c : '_';
        // Runs of foreign characters (UTF-8 bytes, spaces) become one underscore
        if (legal == '_' && !name.empty() && name.back() == '_' && c != '_') continue;
        name += legal;
    }
    if (name.find_first_not_of('_') == std::string::npos) name = "light";
    if (is_numeric(name)) name = "light" + name;
    if (is_mixer_word(name)) name += "_light";
    if (name.size() > max_group_name_bytes) name.resize(max_group_name_bytes);
    return name;
}

bool is_legal_channel_name(std::string_view name) {
    if (name.empty() || name.size() > max_channel_name_bytes) return false;
    const size_t dot = name.find('.');
    const std::string_view layer = name.substr(0, dot);
    const std::string_view rest =
        dot == std::string_view::npos ? std::string_view("x") : name.substr(dot + 1);
    const auto is_clean = [](std::string_view s) {
        return !s.empty() && std::all_of(s.begin(), s.end(), is_name_char);
    };
    return is_clean(layer) && is_clean(rest) && !is_numeric(layer);
}

}  // namespace velatura::accumulate
