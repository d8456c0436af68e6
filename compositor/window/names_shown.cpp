// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/names_shown.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <vector>

namespace velatura::compositor::window {

namespace {

/// Where characters begin, and the end.
std::vector<size_t> character_starts(const std::string& name) {
    std::vector<size_t> starts;
    for (size_t i = 0; i < name.size(); ++i) {
        if ((static_cast<unsigned char>(name[i]) & 0xc0) != 0x80) starts.push_back(i);
    }
    starts.push_back(name.size());
    return starts;
}

std::string lower(std::string_view text) {
    std::string low(text);
    std::transform(low.begin(), low.end(), low.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return low;
}

}  // namespace

std::string shorten_middle(const std::string& name,
                           const std::function<bool(const std::string&)>& fits) {
    if (fits(name)) return name;
    const std::vector<size_t> starts = character_starts(name);
    const size_t count = starts.size() - 1;
    const auto kept = [&](size_t characters) {
        const size_t head = (characters + 1) / 2, tail = characters - head;
        return name.substr(0, starts[head]) + "…" + name.substr(starts[count - tail]);
    };
    // The most characters that fit; widths grow with them
    size_t min = 0, max = count;
    while (min + 1 < max) {
        const size_t middle = (min + max) / 2;
        (fits(kept(middle)) ? min : max) = middle;
    }
    return kept(min);
}

bool is_found(std::string_view name, std::string_view search) {
    const std::string low = lower(name);
    std::istringstream words(lower(search));
    for (std::string word; words >> word;) {
        if (low.find(word) == std::string::npos) return false;
    }
    return true;
}

}  // namespace velatura::compositor::window
