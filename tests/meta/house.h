// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::meta {

/// The house as data: docs/engineering/architecture.md says the same in words.

/// tier → tiers whose headers it may include beside its own and `base`. Tiers are folders below
/// src/, and `compositor`.
const std::map<std::string, std::set<std::string>>& tier_table();

/// A library and the only places where its headers may be included.
struct Library {
    std::string_view header_prefix;         ///< of the text between < and >
    std::vector<std::string_view> allowed;  ///< prefixes of paths from the root; empty = everywhere
};

const std::vector<Library>& library_table();

/// True for headers of the C++ library, of C and of POSIX/Linux.
bool is_system_header(std::string_view header);

}  // namespace velatura::meta
