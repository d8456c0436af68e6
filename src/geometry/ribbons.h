// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/chord_bound.h"
#include "geometry/curve_rows.h"
#include "geometry/primitive_set.h"
#include "scene/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::geometry {

/// Flat curves that face given normals n: from side to side they run along c' × n. A primitive is a
/// *piece* of a segment, ruled between two cubic edges. A ray meets it where it is in one plane
/// with both edges: at roots of a polynomial of degree 6, isolated by the changes of sign of its
/// Bernstein coefficients. Its values at joints are the same to the bit for the pieces at both
/// sides, so nothing passes between them.
///
/// The middle is the curve itself; edges are fitted where they curve otherwise than cubics do, to
/// less than 2^-8 of the width, but for what is cut more than 2^7 times. At kinks both sides meet
/// along the bisector.
class Ribbons final : public PrimitiveSet {
  public:
    /// Nothing where no segment has both a length and a width. The curves have normals.
    static std::shared_ptr<const Ribbons> make(const scene::Curves& curves);

    const char* kind() const override { return "ribbon"; }

    uint32_t size() const override { return uint32_t(pieces_.size()); }

    PrimitiveBounds bounds(uint32_t index) const override;

    std::optional<PrimitiveHit> intersect(uint32_t index,
                                          const Vec3d& o,
                                          const Vec3d& d,
                                          float t_max) const override;

    PrimitiveSurface surface(uint32_t index,
                             const Vec3d& o,
                             const Vec3d& d,
                             const PrimitiveHit& hit) const override;

    /// Along the curve and across.
    bool tangents(uint32_t index,
                  uint32_t face,
                  const Vec3d& p,
                  const PrimitiveHit& hit,
                  Vec3d& dpdu,
                  Vec3d& dpdv) const override;

    bool fiber(uint32_t index, const PrimitiveHit& hit, PrimitiveFiber& out) const override;

    PrimvarRows primvar_rows(uint32_t index,
                             scene::Interpolation interpolation,
                             const PrimitiveHit& hit) const override;

    size_t bytes() const override;

    double area(uint32_t index) const override;

    Vec3d point(uint32_t index, const Vec2d& u) const override;

  private:
    /// Part number `part` of the 2^level equal ones of a segment.
    struct Piece {
        uint32_t segment;
        uint32_t first;  ///< of its four controls
        uint32_t part : 16, level : 8;

        ChordBound bound;

        double begin() const { return double(part) / double(1u << level); }

        double end() const { return double(part + 1) / double(1u << level); }
    };

    /// A control point of both edges.
    struct Control {
        Vec3 left, right;

        bool operator==(const Control&) const = default;
    };

    /// The edges of a piece.
    struct Edges {
        Vec3d left[4], right[4];
    };

    /// Where a line meets a piece.
    struct Intersection {
        double t, u, across;
    };

    class Maker;

    explicit Ribbons(const scene::Curves& curves);

    Edges edges(uint32_t index) const;
    static int intersect_primitive(const Edges& edges,
                                   const Vec3d& o,
                                   const Vec3d& d,
                                   Intersection out[6]);

    CurveRows rows_;
    std::vector<Control> controls_;  ///< along the curves; pieces that join share their ends
    std::vector<Piece> pieces_;
};

}  // namespace velatura::geometry
