// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura {

/// Letters to insert, drop, change or swap with their neighbor to make one of the other; upper and
/// lower case are the same. Ref: Damerau 1964, restricted to one edit per place.
size_t edit_distance(std::string_view a, std::string_view b);

/// The names that a misspelt one may have meant, nearest first: at most a third of its letters away
/// (at least two), or one begins with the other.
std::vector<std::string> nearest_names(std::string_view misspelt,
                                       std::span<const std::string> names,
                                       size_t max = 3);

/// The name that a typing error may have made of: at most two letters away or a third of them, one
/// where there are but four. Of names with ':' the parts behind the last one are compared where
/// what is before it is the same, and `name` is near to `prefix:name`. Empty: none is near, or
/// `written` is one of the names.
std::string nearest_spelling(std::string_view written, std::span<const std::string> names);

/// ` (did you mean 'key' or 'kick'?)`, or an empty text where no name is near.
std::string did_you_mean(std::string_view misspelt, std::span<const std::string> names);

}  // namespace velatura
