// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "meta/rules.h"

#include <string>
#include <vector>

namespace velatura::meta {

/// A class or struct that a file defines.
struct ClassSize {
    std::string name;
    size_t line = 0;  ///< of its opening brace, from 1
    size_t private_methods =
        0;  ///< declared or defined in its body, constructors and operators too
};

/// The classes of a C++ file in the order in which they end, nested and local ones too. Reads the
/// text alone: macros are not expanded.
std::vector<ClassSize> classes_of(const SourceFile&);

/// Size of one tier.
struct TierSize {
    std::string tier;
    size_t files = 0, lines = 0, median_lines = 0;
    std::string largest_file;
    size_t largest_file_lines = 0;
    size_t upward_includes = 0;
    ClassSize largest_class;  ///< by private methods; without a name where none has any
};

/// Sizes of all tiers of the table that have files, by name.
std::vector<TierSize> tier_sizes(const std::vector<SourceFile>& tree);

/// The same as a Markdown table.
std::string tier_size_table(const std::vector<TierSize>&);

}  // namespace velatura::meta
