// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/primitive_set.h"
#include "scene/mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::geometry {

/// Which vertices and primvar rows belong to which segment of which curve. Segments are numbered
/// along the curves, one curve after the other.
class CurveRows {
  public:
    /// The rows of the vertices that a segment is made of, and what its Bézier control values are:
    /// control i is the sum of weight[i][k] times row[k]. Vertices that are not there (pinned
    /// curves have none beyond their ends) are mirrored: they are made of the others.
    struct Stencil {
        uint32_t row[4];
        double weight[4][4];
    };

    explicit CurveRows(const scene::Curves& curves);

    uint32_t curve_count() const { return uint32_t(first_segment_.size()) - 1; }

    uint32_t segment_count() const { return first_segment_.back(); }

    uint32_t first_segment(uint32_t curve) const { return first_segment_[curve]; }

    uint32_t segment_count(uint32_t curve) const {
        return first_segment_[curve + 1] - first_segment_[curve];
    }

    uint32_t curve(uint32_t segment) const;

    bool is_linear() const { return basis_ == scene::Curves::Basis::Linear; }

    bool is_periodic() const { return wrap_ == scene::Curves::Wrap::Periodic; }

    Stencil vertices(uint32_t segment) const;

    /// Rows of the two ends of a segment, of what varies linearly.
    void varying(uint32_t segment, uint32_t row[2]) const;

    /// The rows that a primvar's value is made of at u of the segment.
    PrimvarRows rows(uint32_t segment, scene::Interpolation interpolation, float u) const;

    size_t bytes() const;

  private:
    scene::Curves::Basis basis_;
    scene::Curves::Wrap wrap_;
    // [curve], and one more for what follows the last
    std::vector<uint32_t> first_segment_, first_vertex_, first_varying_;
};

}  // namespace velatura::geometry
