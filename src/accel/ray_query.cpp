// SPDX-License-Identifier: Apache-2.0
#include "accel/ray_query.h"

namespace velatura::accel {

bool is_usable(const Vec3& p) {
    // Written so that NaN is not usable
    return std::abs(p.x) < coordinate_limit && std::abs(p.y) < coordinate_limit &&
           std::abs(p.z) < coordinate_limit;
}

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
    if (!is_usable(a) || !is_usable(b) || !is_usable(c)) return true;
    const Vec3d e1 = Vec3d(b) - Vec3d(a);
    const Vec3d e2 = Vec3d(c) - Vec3d(a);
    // Separately rounded products: zero for exactly parallel edges
    return e1.y * e2.z == e1.z * e2.y && e1.z * e2.x == e1.x * e2.z && e1.x * e2.y == e1.y * e2.x;
}

}  // namespace velatura::accel
