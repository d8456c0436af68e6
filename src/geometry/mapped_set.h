// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/primitive_set.h"

#include <cstdint>
#include <memory>
#include <optional>

namespace velatura::geometry {

/// Another set under an affine map: what an uneven scale makes of balls and round curves. Rays are
/// carried into the other's space, in double.
class MappedSet final : public PrimitiveSet {
  public:
    /// The inner set itself under the identity; nothing for maps that have no inverse or distort by
    /// more than 2^20 to 1.
    static std::shared_ptr<const PrimitiveSet> make(std::shared_ptr<const PrimitiveSet> inner,
                                                    const Mat4d& outer_from_inner);

    const char* kind() const override { return inner_->kind(); }

    uint32_t size() const override { return inner_->size(); }

    PrimitiveBounds bounds(uint32_t index) const override;

    std::optional<PrimitiveHit> intersect(uint32_t index,
                                          const Vec3d& o,
                                          const Vec3d& d,
                                          float t_max) const override;

    PrimitiveSurface surface(uint32_t index,
                             const Vec3d& o,
                             const Vec3d& d,
                             const PrimitiveHit& hit) const override;

    bool tangents(uint32_t index,
                  uint32_t face,
                  const Vec3d& p,
                  const PrimitiveHit& hit,
                  Vec3d& dpdu,
                  Vec3d& dpdv) const override;

    bool fiber(uint32_t index, const PrimitiveHit& hit, PrimitiveFiber& out) const override;

    PrimvarRows primvar_rows(uint32_t index,
                             scene::Interpolation interpolation,
                             const PrimitiveHit& hit) const override {
        return inner_->primvar_rows(index, interpolation, hit);
    }

    size_t bytes() const override { return sizeof(*this) + inner_->bytes(); }

    bool is_convex() const override { return inner_->is_convex(); }

    double area(uint32_t index) const override;

    Vec3d point(uint32_t index, const Vec2d& u) const override;

  private:
    MappedSet() = default;

    std::shared_ptr<const PrimitiveSet> inner_;
    Vec3d origin_ = Vec3d(0.0);  ///< of the inner space
    Mat3d forward_, backward_;   ///< directions from the inner space and back
    Mat3d reach_, round_trip_;   ///< |forward|, |backward|·|forward|
    double condition_ = 1;
};

}  // namespace velatura::geometry
