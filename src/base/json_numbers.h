// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>
#include <utility>

namespace velatura {

/// The whole number that a JSON value of nlohmann's library is. Throws std::out_of_range where it
/// is none, or none of T: get<T>() casts whatever number there is, which is undefined for 1e39.
template <class T, class Json>
T whole_number(const Json& value) {
    if (value.is_number_unsigned()) {
        const auto number = value.template get<uint64_t>();
        if (std::in_range<T>(number)) return T(number);
    } else if (value.is_number_integer()) {
        const auto number = value.template get<int64_t>();
        if (std::in_range<T>(number)) return T(number);
    }
    throw std::out_of_range("not a whole number within bounds");
}

}  // namespace velatura
