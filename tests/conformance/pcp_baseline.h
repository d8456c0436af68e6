// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"

#include <map>
#include <string>
#include <vector>

namespace velatura::usd::compose {

/// Facts of a composed prim by section of a baseline ("Prim Stack", "Child names", …), a line each;
/// "Errors" holds the sorted kinds of errors.
using Sections = std::map<std::string, std::vector<std::string>>;

/// What a `pcp.txt` of the AOUSD composition suite says: prims in order, "" for the layer stack.
struct Baseline {
    std::string root_file;     ///< name of the root layer, below usda/
    bool is_rejected = false;  ///< the reference refused to read the root layer
    std::vector<std::pair<std::string, Sections>> prims;
};

Baseline parse_baseline(const std::string& text);

/// The same facts of a stage of ours.
std::vector<std::pair<std::string, Sections>> composed_facts(Composer& composer,
                                                             const std::string& folder);

/// One line per section that differs; empty when all are equal.
std::vector<std::string> differences(const std::vector<std::pair<std::string, Sections>>& expected,
                                     const std::vector<std::pair<std::string, Sections>>& ours);

}  // namespace velatura::usd::compose
