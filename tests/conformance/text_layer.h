// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace velatura::usd {

/// Whether a file starts like a text layer: "#usda " or "#sdf ", perhaps after a byte order mark.
inline bool is_text_layer(std::string_view bytes) {
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    if (bytes.starts_with(byte_order_mark)) bytes.remove_prefix(byte_order_mark.size());
    return bytes.starts_with("#usda ") || bytes.starts_with("#sdf ");
}

}  // namespace velatura::usd
