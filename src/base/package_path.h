// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura {

/// Packages within packages beyond which a name is not followed.
inline constexpr size_t max_package_depth = 16;

/// The parts of a name within packages, outermost first: "a.usdz[b.usdz[c.png]]" gives {"a.usdz",
/// "b.usdz", "c.png"}, any other name itself. Brackets of member names are written "\[" and "\]".
/// At most max_package_depth + 2 parts; what is deeper stays in the last.
std::vector<std::string> split_package_path(std::string_view name);

/// The name that split_package_path takes apart. Empty without parts.
std::string join_package_path(std::span<const std::string> parts);

/// True for names with more than one part.
bool is_package_path(std::string_view name);

}  // namespace velatura
