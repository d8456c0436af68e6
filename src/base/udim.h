// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace velatura {

/// Tiles of an image that is stored in several files, ten in a row: "<UDIM>" in a name stands for
/// their numbers.
inline constexpr int udim_first = 1001;
inline constexpr int udim_count = 100;
inline constexpr int udim_row = 10;

bool is_udim_name(std::string_view name);

/// The name of tile udim_first + i, whether it is there or not. `name` is a UDIM name.
std::string udim_tile_name(std::string name, int i);

/// Names of the files that a name stands for: those of the tiles that are there, or itself where it
/// is no UDIM name.
std::vector<std::string> udim_files(const std::string& name);

}  // namespace velatura
