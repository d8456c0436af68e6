// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura {

/// A place in a text the user wrote. file_id indexes Diagnostics::files(); line and column count
/// from 1. line 0 means "no place inside the file"; file_id 0 means "no file".
struct SourceLoc {
    uint32_t file_id = 0;
    uint32_t line = 0;
    uint32_t column = 0;

    bool operator==(const SourceLoc&) const = default;

    bool is_known() const { return file_id != 0; }
};

}  // namespace velatura
