// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace velatura::usd::layer {

/// First and last code point of a range.
struct CodePointRange {
    uint32_t first;
    uint32_t last;
};

/// Sorted ranges above U+007F.
std::span<const CodePointRange> xid_start_ranges();
std::span<const CodePointRange> xid_continue_ranges();

}  // namespace velatura::usd::layer
