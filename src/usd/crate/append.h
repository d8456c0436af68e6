// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>

namespace velatura::usd::crate {

/// Appends the bytes of a value, little-endian as the machine is.
template <class T>
void append(std::string& out, const T& value) {
    static_assert(std::is_trivially_destructible_v<T>);
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace velatura::usd::crate
