// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace velatura::usd::text {

/// Shortest text that reads back as the same number; "1e-7", "1e16", "0.000001", "inf".
/// Ref: AOUSD Core Specification 1.0.1, 16.2.5.1.
void append_number(std::string& out, double v);
void append_number(std::string& out, float v);

/// The text as a string literal: double quotes preferred, tripled around line ends, escapes where
/// needed.
void append_quoted(std::string& out, std::string_view text);
/// The path between @ or, where it holds one, @@@.
void append_asset(std::string& out, std::string_view path);

}  // namespace velatura::usd::text
