// SPDX-License-Identifier: Apache-2.0
#include "accel/placement.h"

#include "accel/ray_query.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::accel {

namespace {

// Inverse by cofactors; false when there is none.
bool invert(const Mat4& m, InstanceRecord& record) {
    const Mat4d forward(m);
    const double det = determinant3(forward);
    if (!(std::abs(det) > 0)) return false;
    const Mat3d cofactors = cofactor_matrix(forward);
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) record.prototype_from_render[i][k] = cofactors[k][i] / det;
    }
    for (int k = 0; k < 3; ++k) {
        double t = 0;
        for (int i = 0; i < 3; ++i) t -= forward[3][i] * record.prototype_from_render[i][k];
        record.prototype_from_render[3][k] = t;
    }
    for (const auto& row : record.prototype_from_render) {
        for (const double entry : row) {
            if (!std::isfinite(entry)) return false;
        }
    }
    return true;
}

}  // namespace

bool place(const Mat4& m, const Box3& bounds, PlacedBox& placed) {
    if (!is_finite(m, coordinate_limit) || !invert(m, placed.record)) return false;
    placed.condition = 0;
    for (int i = 0; i < 3; ++i) {
        double row = 0;
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) {
                row += std::abs(placed.record.prototype_from_render[i][j] * double(m[j][k]));
            }
        }
        placed.condition = std::max(placed.condition, row);
    }
    placed.lower = Vec3d(std::numeric_limits<double>::max());
    placed.upper = Vec3d(std::numeric_limits<double>::lowest());
    double magnitude = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p(double((corner & 1) ? bounds.max.x : bounds.min.x),
                      double((corner & 2) ? bounds.max.y : bounds.min.y),
                      double((corner & 4) ? bounds.max.z : bounds.min.z));
        for (int k = 0; k < 3; ++k) {
            const double term[4] = {p.x * double(m[0][k]), p.y * double(m[1][k]),
                                    p.z * double(m[2][k]), double(m[3][k])};
            const double x = term[0] + term[1] + term[2] + term[3];
            placed.lower[k] = std::min(placed.lower[k], x);
            placed.upper[k] = std::max(placed.upper[k], x);
            for (const double summand : term) magnitude = std::max(magnitude, std::abs(summand));
        }
    }
    // Grow by the error of mapping there and back
    const double pad = 0x1p-46 * placed.condition * magnitude;
    for (int k = 0; k < 3; ++k) {
        placed.lower[k] -= pad;
        placed.upper[k] += pad;
        if (!(std::abs(placed.lower[k]) < double(coordinate_limit))) return false;
        if (!(std::abs(placed.upper[k]) < double(coordinate_limit))) return false;
    }
    return true;
}

void enter(const InstanceRecord& instance, const geometry::Ray& ray, Vec3d& o, Vec3d& d) {
    const auto& m = instance.prototype_from_render;
    for (int k = 0; k < 3; ++k) {
        d[k] = double(ray.d.x) * m[0][k] + double(ray.d.y) * m[1][k] + double(ray.d.z) * m[2][k];
        o[k] = double(ray.o.x) * m[0][k] + double(ray.o.y) * m[1][k] + double(ray.o.z) * m[2][k] +
               m[3][k];
    }
}

bool round_outward(const Box3d& box, Box3& out) {
    for (int k = 0; k < 3; ++k) {
        // Written so that NaN does not fit
        if (!(box.min[k] <= box.max[k])) return false;
        if (!(box.min[k] > -double(coordinate_limit) && box.max[k] < double(coordinate_limit)))
            return false;
        out.min[k] = next_float_down(float(box.min[k]));
        out.max[k] = next_float_up(float(box.max[k]));
    }
    return true;
}

}  // namespace velatura::accel
