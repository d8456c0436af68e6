// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/crate/cursor.h"

#include <cstdint>
#include <string>
#include <utility>

namespace velatura::usd::crate {

/// Levels of dictionaries and other values within values; the text reader's limit.
inline constexpr int max_value_depth = 256;

/// What the readers of a file's values share: the file, the limits, and what was wrong. Values
/// share parts, so a small file can stand for very much: what is copied is counted, and reading
/// ends at a limit.
struct ValueContext {
    CrateFilePtr file;
    uint64_t bytes_left;  ///< that values may still take
    bool is_sample;       ///< the values are samples of time samples
    int depth = 0;        ///< levels of values that are being read
    Problem problem;

    /// Keeps a problem; always false.
    bool fail(uint64_t at, std::string message) {
        problem = {at, std::move(message)};
        return false;
    }

    bool fail(const Cursor& c) {
        problem = c.problem();
        return false;
    }

    /// Counts bytes that a value takes; false, with the problem in the cursor, beyond the limit.
    bool spend(Cursor& c, uint64_t bytes) {
        if (bytes <= bytes_left) {
            bytes_left -= bytes;
            return true;
        }
        bytes_left = 0;
        return c.fail("more values than the file's size allows", "fewer, limit reached");
    }

    /// A count of items of `stored_bytes` in the file and `bytes` in memory each.
    uint64_t count(Cursor& c, uint64_t stored_bytes, uint64_t bytes) {
        const uint64_t n = c.count(stored_bytes);
        return spend(c, n * bytes) ? n : 0;
    }
};

}  // namespace velatura::usd::crate
