// SPDX-License-Identifier: Apache-2.0
#include "base/nearest_names.h"

#include <algorithm>
#include <cctype>
#include <utility>

namespace velatura {

namespace {

char lower(char c) {
    return char(std::tolower(static_cast<unsigned char>(c)));
}

bool begins_with(std::string_view text, std::string_view beginning) {
    return text.size() >= beginning.size() &&
           std::equal(beginning.begin(), beginning.end(), text.begin(),
                      [](char a, char b) { return lower(a) == lower(b); });
}

}  // namespace

size_t edit_distance(std::string_view a, std::string_view b) {
    // Distances of a's beginning with i letters from each beginning of b, for the last three i
    std::vector<size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (size_t i = 1; i <= a.size(); ++i) {
        std::swap(before_last, last);
        std::swap(last, row);
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            const bool is_same = lower(a[i - 1]) == lower(b[j - 1]);
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (is_same ? 0 : 1)});
            const bool is_swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                                    lower(a[i - 2]) == lower(b[j - 1]);
            if (is_swapped) row[j] = std::min(row[j], before_last[j - 2] + 1);
        }
    }
    return row[b.size()];
}

std::vector<std::string> nearest_names(std::string_view misspelt,
                                       std::span<const std::string> names,
                                       size_t most) {
    const size_t allowed = std::max<size_t>(2, misspelt.size() / 3);
    std::vector<std::pair<size_t, std::string>> near;
    for (const std::string& name : names) {
        const size_t distance = edit_distance(misspelt, name);
        // A short name is near to every other
        const bool is_near =
            distance <= allowed && distance < std::max(name.size(), misspelt.size());
        const bool is_part = misspelt.size() > 1 && name.size() > 1 &&
                             (begins_with(name, misspelt) || begins_with(misspelt, name));
        if (is_near || is_part) near.emplace_back(distance, name);
    }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    std::vector<std::string> found;
    for (size_t i = 0; i < std::min(most, near.size()); ++i) found.push_back(near[i].second);
    return found;
}

std::string did_you_mean(std::string_view misspelt, std::span<const std::string> names) {
    const std::vector<std::string> near = nearest_names(misspelt, names);
    std::string text;
    for (size_t i = 0; i < near.size(); ++i) {
        text += i == 0 ? " (did you mean " : i + 1 == near.size() ? " or " : ", ";
        text += "'" + near[i] + "'";
    }
    return text.empty() ? text : text + "?)";
}

}  // namespace velatura
