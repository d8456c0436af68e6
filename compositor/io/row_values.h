// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "layers/strip_reader.h"

#include <cstddef>

namespace velatura::compositor {
inline namespace io {

/// Values [first, first + count) of a channel as floats. NaN and infinity become 0.
/// Returns: true if any of them was not finite.
bool load_row(const layers::StripChannel& channel, size_t first, size_t count, float* row);

/// How many of the values are not finite, and the first of them.
struct NotFinite {
    size_t count = 0, first = 0;
};

NotFinite find_not_finite(const layers::StripChannel& channel, size_t first, size_t count);

}  // namespace io
}  // namespace velatura::compositor
