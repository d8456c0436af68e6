// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace velatura {

/// No text of ours nests objects and arrays deeper than a few levels.
inline constexpr int deepest_json = 64;

/// True if arrays and objects of a JSON text lie deeper in each other than `deepest_json`. Ask
/// before reading texts of files: copying and printing what was read takes stack for every level.
/// Of a text that is no JSON either answer.
bool is_json_too_deep(std::string_view text);

}  // namespace velatura
