// SPDX-License-Identifier: Apache-2.0
#include "base/unique_names.h"

#include <algorithm>
#include <utility>

namespace velatura {

std::string UniqueNames::make(std::string name) {
    if (name.size() > max_bytes_) name.resize(max_bytes_);
    if (taken_.insert(name).second) return name;
    size_t& number = next_.try_emplace(name, 2).first->second;
    std::string candidate;
    do {
        const std::string suffix = between_ + std::to_string(number++);
        candidate = name.substr(0, std::min(name.size(), max_bytes_ - suffix.size())) + suffix;
    } while (!taken_.insert(candidate).second);
    return candidate;
}

}  // namespace velatura
