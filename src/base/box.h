// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura {

/// The box around the images of the corners; empty for an empty one.
inline Box3d transformed(const Box3d& box, const Mat4d& m) {
    Box3d out;
    if (box.isEmpty()) return out;
    for (int i = 0; i < 8; ++i)
        out.extendBy(
            transform_point(Vec3d(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                  i & 4 ? box.max.z : box.min.z),
                            m));
    return out;
}

}  // namespace velatura
