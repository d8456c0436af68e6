// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/curve_rows.h"
#include "scene/mesh.h"

#include <cstdint>
#include <vector>

namespace velatura::geometry {

/// The ideal ribbon: the middle of every segment of a curve as a cubic, and at every place the
/// vector from there to the right edge.
class RibbonShape {
  public:
    RibbonShape(const scene::Curves& curves, const CurveRows& rows);

    /// Turns to another curve of the set.
    void set_curve(uint32_t curve);

    /// Bézier control points of the middle.
    void middle(uint32_t segment, Vec3d out[4]) const;

    /// Half the width across the curve and its normal.
    Vec3d half(uint32_t segment, double u) const;

    /// Whether the segment has no length.
    bool is_point(uint32_t segment) const;

  private:
    Vec3d normal(uint32_t segment, double u) const;
    double width(uint32_t segment, double u) const;

    const scene::Curves& curves_;
    const CurveRows& rows_;
    uint32_t first_ = 0;  ///< segment of the curve
    /// [joint] directions that both sides of joints share, unit; zero where there is none.
    std::vector<Vec3d> joints_;
};

}  // namespace velatura::geometry
