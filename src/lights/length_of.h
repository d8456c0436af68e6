// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cmath>

namespace velatura::lights {

/// The root of the sum of squares, without Vec3d::length()'s detour for tiny vectors.
inline double length_of(const Vec3d& v) {
    return std::sqrt(v.dot(v));
}

}  // namespace velatura::lights
