// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <array>
#include <cmath>

namespace velatura::scene {

/// How numbers of a color space become linear numbers of the working space: first without their
/// curve, then in its primaries. Negative numbers have the curve's mirror image.
struct ColorDecoding {
    /// |v| up to `cut`: v / slope; above: ((|v| + offset) / (1 + offset))^exponent.
    double exponent = 1, offset = 0, cut = 0, slope = 1;
    /// Row by row, of column vectors.
    std::array<double, 9> to_working = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    bool operator==(const ColorDecoding&) const = default;

    bool has_curve() const { return exponent != 1.0; }

    bool has_primaries() const { return to_working != ColorDecoding().to_working; }

    bool is_identity() const { return !has_curve() && !has_primaries(); }

    double without_curve(double v) const {
        if (!has_curve()) return v;
        const double size = std::abs(v);
        const double linear =
            size <= cut ? size / slope : std::pow((size + offset) / (1.0 + offset), exponent);
        return std::copysign(linear, v);
    }

    Vec3d operator()(const Vec3d& color) const {
        const Vec3d v(without_curve(color.x), without_curve(color.y), without_curve(color.z));
        if (!has_primaries()) return v;
        const auto& m = to_working;
        return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                m[6] * v.x + m[7] * v.y + m[8] * v.z};
    }
};

}  // namespace velatura::scene
