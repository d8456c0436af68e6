// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace velatura {

/// RFC 4648, with padding.
std::string to_base64(std::string_view bytes);

/// Up to the first character that is no digit of it, as padding is.
std::string from_base64(std::string_view text);

}  // namespace velatura
