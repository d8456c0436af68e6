// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace velatura {

/// The text as content or attribute of XML and HTML. Control characters but tab and newline, which
/// XML 1.0 does not have, become spaces.
std::string escape_markup(std::string_view text);

}  // namespace velatura
