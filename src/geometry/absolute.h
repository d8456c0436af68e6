// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cmath>

namespace velatura::geometry {

/// Absolute values, component by component: of error bounds.
inline Vec3d absolute(const Vec3d& v) {
    return {std::abs(v.x), std::abs(v.y), std::abs(v.z)};
}

inline Mat3d absolute(const Mat3d& m) {
    Mat3d out;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) out[i][k] = std::abs(m[i][k]);
    return out;
}

inline Mat4d absolute(const Mat4d& m) {
    Mat4d out;
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) out[i][k] = std::abs(m[i][k]);
    return out;
}

}  // namespace velatura::geometry
