// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <array>

namespace velatura::geometry {

/// One cell of a lattice with numbers at its corners, trilinear between them. Places are local, in
/// [0, 1]³. What is below 0 is inside of the level set.
///
/// Numbers on a face are those of its four corners alone, to the bit: cells that share a face agree
/// on them, whatever rounding does. That is what keeps the surface closed.
struct LevelSetCell {
    std::array<double, 8> corner;  ///< [z][y][x]

    static bool is_inside(double number) { return number < 0.0; }

    /// Corners on both sides: elsewhere no number of the cell is on the other side.
    bool is_mixed() const;

    double number(const Vec3d& p) const;
    Vec3d gradient(const Vec3d& p) const;

    /// Where the segment from p to q goes from one side to the other, in order, as shares of it.
    struct Crossings {
        std::array<double, 3> at;
        int count = 0;
    };

    /// At its ends the numbers are exactly those of the faces there, so that between ends on
    /// different sides there always is one.
    Crossings crossings(const Vec3d& p, const Vec3d& q) const;
};

}  // namespace velatura::geometry
