// SPDX-License-Identifier: Apache-2.0
#include "meta/rules.h"

#include <algorithm>
#include <array>
#include <regex>
#include <string>

namespace velatura::meta {

namespace {

struct StandardHeader {
    std::string name;
    std::regex use;
    std::string also_by;  ///< another header that may stand for it; empty: none
};

/// The standard headers that precompiled headers bring (src/cmake/velatura_precompiled.cmake), and
/// what uses them. Names that several headers declare (swap, hash, …) are with the one that is
/// theirs in the standard.
const std::vector<StandardHeader>& standard_headers() {
    static const std::vector<StandardHeader> table = [] {
        constexpr std::array<std::array<const char*, 3>, 25> rows = {{
            {"algorithm",
             R"(std::(sort|stable_sort|min|max|clamp|find|find_if|any_of|all_of|none_of|copy|fill)"
             R"(|reverse|lower_bound|upper_bound|count|count_if|transform|max_element|min_element)"
             R"(|unique|remove_if|equal|nth_element|partition|rotate|minmax|for_each|copy_n)"
             R"(|binary_search|fill_n|is_sorted|partial_sort|mismatch)\()",
             ""},
            {"array", R"(std::(array|to_array)\b)", ""},
            {"atomic", R"(std::(atomic\w*|memory_order\w*)\b)", ""},
            {"bit", R"(std::(bit_cast|count[rl]_zero|popcount|bit_width|bit_ceil|rot[lr])\b)", ""},
            {"charconv", R"(std::(from|to)_chars\b)", ""},
            {"chrono", R"(std::chrono\b)", ""},
            {"cmath",
             R"(std::(sqrt|abs|pow|exp2?|log[21]?p?|sin|cos|tan|a(tan2?|sin|cos)|floor|ceil|round)"
             R"(|lround|hypot|isfinite|isnan|isinf|fmod|ldexp|frexp|cbrt|nextafter|copysign|trunc)"
             R"(|signbit|fma|lerp|scalbn|nearbyint)\()",
             ""},
            {"cstdint", R"(\bu?int(8|16|32|64)_t\b)", ""},
            {"cstring", R"(std::(mem(cpy|set|cmp|move|chr)|str(len|cmp|error))\b)", ""},
            {"functional", R"(std::(function|hash|reference_wrapper)\b)", ""},
            {"limits", R"(std::numeric_limits\b)", ""},
            {"map", R"(std::(multi)?map\b)", ""},
            {"memory", R"(std::((unique|shared|weak)_ptr|make_(unique|shared)|addressof)\b)", ""},
            {"mutex", R"(std::(mutex|lock_guard|unique_lock|scoped_lock|once_flag|call_once)\b)",
             ""},
            {"numeric", R"(std::(accumulate|iota|reduce|inner_product|partial_sum|gcd)\()", ""},
            {"optional", R"(std::(optional|nullopt)\b)", ""},
            {"set", R"(std::(multi)?set\b)", ""},
            {"span", R"(std::(span|as_bytes)\b)", ""},
            {"string", R"(std::(string|to_string)\b)", ""},
            {"string_view", R"(std::string_view\b)", "string"},
            {"unordered_map", R"(std::unordered_map\b)", ""},
            {"unordered_set", R"(std::unordered_set\b)", ""},
            {"utility", R"(std::(move|pair|swap|exchange|forward|declval|index_sequence)\b)", ""},
            {"variant", R"(std::(variant|visit|holds_alternative|get_if|monostate)\b)", ""},
            {"vector", R"(std::vector\b)", ""},
        }};
        std::vector<StandardHeader> headers;
        headers.reserve(rows.size());
        for (const auto& row : rows) headers.push_back({row[0], std::regex(row[1]), row[2]});
        return headers;
    }();
    return table;
}

}  // namespace

std::vector<std::string> check_standard_includes(const SourceFile& file) {
    if (!file.ends_with(".h") || file.is_below("tests/")) return {};
    std::string all;
    for (const std::string& line : file.lines) all += line.substr(0, line.find("//")) + "\n";
    const auto has = [&](const std::string& name) {
        return !name.empty() && all.find("#include <" + name + ">") != std::string::npos;
    };
    std::vector<std::string> out;
    for (const StandardHeader& header : standard_headers()) {
        std::smatch use;
        if (has(header.name) || has(header.also_by) || !std::regex_search(all, use, header.use))
            continue;
        const auto line = std::count(all.cbegin(), use[0].first, '\n') + 1;
        out.push_back(file.path + ":" + std::to_string(line) + ": " + use.str() +
                      " needs #include <" + header.name + ">");
    }
    return out;
}

}  // namespace velatura::meta
