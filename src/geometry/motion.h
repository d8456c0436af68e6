// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cstdint>

namespace velatura::geometry {

/// Where a time lies among segments of equal length between keys: from key `segment` on, f of the
/// way to the next one.
struct MotionTime {
    uint32_t segment = 0;
    float f = 0;  ///< in [0, 1], 1 only where the shutter closes
};

/// Times run over the shutter, from 0 when it opens to 1 when it closes; others count as the
/// nearest of these. segments: at least 1.
inline MotionTime motion_time(float time, uint32_t segments) {
    // Written so that NaN is 0
    const float x = std::min(std::max(0.0f, time), 1.0f) * float(segments);
    const uint32_t segment = std::min(uint32_t(x), segments - 1);
    return {segment, x - float(segment)};
}

/// The definition of where a number is between two keys: each operation rounds by itself. Exactly a
/// at f = 0 and where a = b.
inline float moved(float a, float b, float f) {
    return a + f * (b - a);
}

inline Vec3 moved(const Vec3& a, const Vec3& b, float f) {
    return {moved(a.x, b.x, f), moved(a.y, b.y, f), moved(a.z, b.z, f)};
}

/// Entry by entry.
inline Mat4 moved(const Mat4& a, const Mat4& b, float f) {
    Mat4 m;
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) m[i][k] = moved(a[i][k], b[i][k], f);
    return m;
}

}  // namespace velatura::geometry
