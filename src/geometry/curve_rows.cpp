// SPDX-License-Identifier: Apache-2.0
#include "geometry/curve_rows.h"

#include "base/check.h"
#include "scene/curves.h"

#include <algorithm>

namespace velatura::geometry {

namespace {

using Basis = scene::Curves::Basis;
using Wrap = scene::Curves::Wrap;

/// [basis][control][vertex] Bézier control values by the four vertices of a segment. Ref: Catmull,
/// Rom 1974; Barsky 1982 (B-splines); Linear: of its two vertices, in the middle.
constexpr double bezier_of[4][4][4] = {
    {{0, 1, 0, 0}, {0, 2.0 / 3, 1.0 / 3, 0}, {0, 1.0 / 3, 2.0 / 3, 0}, {0, 0, 1, 0}},
    {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}},
    {{1.0 / 6, 4.0 / 6, 1.0 / 6, 0},
     {0, 4.0 / 6, 2.0 / 6, 0},
     {0, 2.0 / 6, 4.0 / 6, 0},
     {0, 1.0 / 6, 4.0 / 6, 1.0 / 6}},
    {{0, 1, 0, 0}, {-1.0 / 6, 1, 1.0 / 6, 0}, {0, 1.0 / 6, 1, -1.0 / 6}, {0, 0, 1, 0}},
};

}  // namespace

CurveRows::CurveRows(const scene::Curves& curves) : basis_(curves.basis), wrap_(curves.wrap) {
    // Pinning makes no difference to curves that meet their ends anyway
    const bool meets_ends = basis_ == Basis::Linear || basis_ == Basis::Bezier;
    if (meets_ends && wrap_ == Wrap::Pinned) wrap_ = Wrap::Nonperiodic;
    uint32_t segment = 0, vertex = 0, varying = 0;
    for (size_t i = 0; i <= curves.vertex_counts.size(); ++i) {
        first_segment_.push_back(segment);
        first_vertex_.push_back(vertex);
        first_varying_.push_back(varying);
        if (i == curves.vertex_counts.size()) break;
        const uint32_t count = curves.vertex_counts[i];
        const size_t segments = scene::segment_count(basis_, wrap_, count);
        VELATURA_CHECK(segments > 0, "a curve of a wrong number of vertices");
        segment += uint32_t(segments);
        vertex += count;
        varying += uint32_t(scene::varying_count(basis_, wrap_, count));
    }
}

uint32_t CurveRows::curve(uint32_t segment) const {
    const auto after = std::upper_bound(first_segment_.begin(), first_segment_.end(), segment);
    return uint32_t(after - first_segment_.begin()) - 1;
}

CurveRows::Stencil CurveRows::vertices(uint32_t segment) const {
    const uint32_t c = curve(segment), within = segment - first_segment_[c];
    const uint32_t count = first_vertex_[c + 1] - first_vertex_[c];
    const uint32_t step = basis_ == Basis::Bezier ? 3 : 1;
    // Of linear curves the segment lies between the second and the third, as of Catmull and Rom's
    int64_t first = int64_t(within) * step;
    if (basis_ == Basis::Linear || wrap_ == Wrap::Pinned) --first;
    Stencil stencil{};
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) stencil.weight[i][k] = bezier_of[int(basis_)][i][k];
    // What lies beyond an end is its mirror image: twice the end less its neighbor
    const auto mirror = [&](int missing, int end, int neighbor) {
        for (auto& weight : stencil.weight) {
            weight[end] += 2.0 * weight[missing];
            weight[neighbor] -= weight[missing];
            weight[missing] = 0.0;
        }
    };
    const bool is_pinned = wrap_ == Wrap::Pinned;
    if (is_pinned && first < 0) mirror(0, 1, 2);
    if (is_pinned && first + 3 >= int64_t(count)) mirror(3, 2, 1);
    for (int k = 0; k < 4; ++k) {
        int64_t vertex = first + k;
        if (wrap_ == Wrap::Periodic) vertex = (vertex + count) % count;
        vertex = std::clamp<int64_t>(vertex, 0, int64_t(count) - 1);
        stencil.row[k] = first_vertex_[c] + uint32_t(vertex);
    }
    return stencil;
}

void CurveRows::varying(uint32_t segment, uint32_t row[2]) const {
    const uint32_t c = curve(segment), within = segment - first_segment_[c];
    const uint32_t count = first_varying_[c + 1] - first_varying_[c];
    row[0] = first_varying_[c] + within;
    row[1] = first_varying_[c] + (within + 1 < count ? within + 1 : 0);
}

PrimvarRows CurveRows::rows(uint32_t segment, scene::Interpolation interpolation, float u) const {
    PrimvarRows rows;
    switch (interpolation) {
        case scene::Interpolation::Constant:
            return rows;
        case scene::Interpolation::Uniform:
            rows.row[0] = curve(segment);
            return rows;
        case scene::Interpolation::Vertex: {
            const Stencil stencil = vertices(segment);
            const double t = double(u), s = 1.0 - t;
            const double bernstein[4] = {s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t};
            rows.count = 4;
            for (int k = 0; k < 4; ++k) {
                double weight = 0;
                for (int i = 0; i < 4; ++i) weight += bernstein[i] * stencil.weight[i][k];
                rows.row[k] = stencil.row[k];
                rows.weight[k] = float(weight);
            }
            return rows;
        }
        default:
            varying(segment, rows.row);
            rows.count = 2;
            rows.weight[0] = 1.0f - u;
            rows.weight[1] = u;
            return rows;
    }
}

size_t CurveRows::bytes() const {
    return (first_segment_.capacity() + first_vertex_.capacity() + first_varying_.capacity()) *
           sizeof(uint32_t);
}

}  // namespace velatura::geometry
