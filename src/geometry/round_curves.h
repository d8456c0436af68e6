// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/chord_bound.h"
#include "geometry/curve_rows.h"
#include "geometry/primitive_set.h"
#include "geometry/sweep.h"
#include "scene/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::geometry {

/// Round curves: what balls along cubic curves fill, their widths varying. Ends and kinks are
/// round, since a ball belongs to both sides of every joint, and nothing passes between segments.
///
/// A primitive is a *piece* of a segment: segments are divided where their balls overlap from more
/// than one side (see is_regular) and where the boxes of parts are much smaller. Where pieces join,
/// the ball at the joint counts only as far as the neighbor does not fill it, so that rays inside
/// a curve meet no walls but on the inner side of kinks. Bends tighter than the curve is thick are
/// made of cones, which stray from the curve by less than 2^-10 of the radius, but for what is cut
/// more than 2^12 times.
class RoundCurves final : public PrimitiveSet {
  public:
    /// Nothing where no segment has both a length and a width.
    static std::shared_ptr<const RoundCurves> make(const scene::Curves& curves);

    const char* kind() const override { return "curve"; }

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

    /// Along the curve and around it.
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
        uint32_t part : 16, level : 5;
        uint32_t is_straight : 1;   ///< a cone in place of the curve
        uint32_t joins_before : 1;  ///< another piece ends where this begins
        uint32_t joins_after : 1;

        ChordBound bound;

        double begin() const { return double(part) / double(1u << level); }

        double end() const { return double(part + 1) / double(1u << level); }
    };

    /// A control point; r is half the width.
    struct Control {
        Vec3 p;
        float r;
    };

    explicit RoundCurves(const scene::Curves& curves);

    void set_controls(const scene::Curves& curves);
    void divide(uint32_t segment, uint32_t part, uint32_t level);
    bool join(const Piece& before, const Piece& after) const;
    void join_pieces();
    Sweep segment_sweep(uint32_t segment) const;
    Sweep sweep_of(const Piece& piece) const;
    bool is_filled(uint32_t index, const SweepCrossing& crossing) const;

    CurveRows rows_;
    std::vector<Control> controls_;        ///< [3·segment + curve + k]: segments share their ends
    std::vector<uint32_t> first_piece_;    ///< [curve], and one more
    std::vector<uint32_t> first_control_;  ///< [segment]
    std::vector<Piece> pieces_;            ///< along the curves
};

}  // namespace velatura::geometry
