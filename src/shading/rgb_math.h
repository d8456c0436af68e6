// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>

/// Arithmetic of reflectances, channel by channel.
namespace velatura::shading {

inline Rgb clamp01(const Rgb& c) {
    return {std::clamp(c.x, 0.0f, 1.0f), std::clamp(c.y, 0.0f, 1.0f), std::clamp(c.z, 0.0f, 1.0f)};
}

/// What a reflectance leaves; rounding must not make it negative.
inline Rgb one_minus(const Rgb& c) {
    return {std::max(1.0f - c.x, 0.0f), std::max(1.0f - c.y, 0.0f), std::max(1.0f - c.z, 0.0f)};
}

inline float mean(const Rgb& c) {
    return (c.x + c.y + c.z) * (1.0f / 3.0f);
}

/// a / b per channel, 0 where b is 0.
inline Rgb safe_divide(const Rgb& a, const Rgb& b) {
    return {b.x > 0.0f ? a.x / b.x : 0.0f, b.y > 0.0f ? a.y / b.y : 0.0f,
            b.z > 0.0f ? a.z / b.z : 0.0f};
}

}  // namespace velatura::shading
