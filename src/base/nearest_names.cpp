// SPDX-License-Identifier: Apache-2.0
#include "base/nearest_names.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
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
                                       size_t max) {
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
    for (size_t i = 0; i < std::min(max, near.size()); ++i) found.push_back(near[i].second);
    return found;
}

std::string nearest_spelling(std::string_view written, std::span<const std::string> names) {
    const auto tail_of = [](std::string_view text) {
        const size_t colon = text.rfind(':');
        return colon == std::string_view::npos ? text : text.substr(colon + 1);
    };
    const auto allowed = [](size_t letters) {
        return letters <= 4 ? size_t(1) : std::max<size_t>(2, letters / 3);
    };
    std::string nearest;
    size_t min = SIZE_MAX;
    const std::string_view tail = tail_of(written);
    for (const std::string& name : names) {
        if (name == written) return {};
        const std::string_view name_tail = tail_of(name);
        const size_t head = written.size() - tail.size();
        const bool has_same_head =
            head == name.size() - name_tail.size() &&
            edit_distance(written.substr(0, head), name.substr(0, head)) == 0;
        const size_t letters = std::min(tail.size(), name_tail.size());
        size_t distance = SIZE_MAX;
        if (has_same_head) {
            const size_t edits = edit_distance(tail, name_tail);
            if (edits <= allowed(letters) && edits < letters) distance = edits;
        }
        if (head == 0 && name.size() > name_tail.size() && edit_distance(tail, name_tail) == 0)
            distance = 1;
        const size_t whole = std::min(written.size(), name.size());
        if (distance > 1 && whole > 4) {
            const size_t edits = edit_distance(written, name);
            if (edits <= 2) distance = std::min(distance, edits);
        }
        if (distance < min) {
            min = distance;
            nearest = name;
        }
    }
    return nearest;
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
