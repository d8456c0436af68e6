// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace velatura {

/// Names that differ from each other, by numbers behind those that would not. As fast with
/// thousands of equal ones as with others.
class UniqueNames {
  public:
    /// `between` the name and its number. No name gets longer than `max_bytes`, which must leave
    /// room for the number.
    explicit UniqueNames(std::string_view between = "_", size_t max_bytes = std::string::npos)
        : between_(between), max_bytes_(max_bytes) {}

    bool has(const std::string& name) const { return taken_.contains(name); }

    /// Lets make() give this one to nobody.
    void take(std::string name) { taken_.insert(std::move(name)); }

    /// The name itself, else with the first number from 2 on that makes it another than all before;
    /// shortened to fit.
    std::string make(std::string name);

  private:
    std::string between_;
    size_t max_bytes_;
    std::unordered_set<std::string> taken_;
    std::unordered_map<std::string, size_t> next_;  ///< by name: all numbers below are taken
};

}  // namespace velatura
