// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/primitive_set.h"
#include "scene/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::geometry {

/// Balls, many to a set, met as Quadric meets one: in double, by the distance of the line from the
/// center.
class SphereSet final : public PrimitiveSet {
  public:
    /// Nothing where no point has a width.
    static std::shared_ptr<const SphereSet> make(const scene::Points& points);

    const char* kind() const override { return "point"; }

    uint32_t size() const override { return uint32_t(spheres_.size()); }

    PrimitiveBounds bounds(uint32_t index) const override;

    std::optional<PrimitiveHit> intersect(uint32_t index,
                                          const Vec3d& o,
                                          const Vec3d& d,
                                          float t_max) const override;

    PrimitiveSurface surface(uint32_t index,
                             const Vec3d& o,
                             const Vec3d& d,
                             const PrimitiveHit& hit) const override;

    /// Around the z axis, and up.
    bool tangents(uint32_t index,
                  uint32_t face,
                  const Vec3d& p,
                  const PrimitiveHit& hit,
                  Vec3d& dpdu,
                  Vec3d& dpdv) const override;

    PrimvarRows primvar_rows(uint32_t index,
                             scene::Interpolation interpolation,
                             const PrimitiveHit& hit) const override;

    size_t bytes() const override { return sizeof(*this) + spheres_.capacity() * sizeof(Sphere); }

    bool is_convex() const override { return true; }

    double area(uint32_t index) const override;

    Vec3d point(uint32_t index, const Vec2d& u) const override;

  private:
    struct Sphere {
        Vec3 center;
        float radius;
    };

    static bool intersect_primitive(const Sphere& sphere,
                                    const Vec3d& o,
                                    const Vec3d& d,
                                    double t[2]);

    std::vector<Sphere> spheres_;  ///< by point; those without a radius are left out by their box
};

}  // namespace velatura::geometry
