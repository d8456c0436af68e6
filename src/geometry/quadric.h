// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/primitive_set.h"
#include "scene/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>

namespace velatura::geometry {

/// One Sphere, Cylinder, Cone or Capsule under an affine map: a closed convex solid, so that a ray
/// is inside of it along one interval. The ends of that interval are the hits; those of solids with
/// several faces come from intersecting the intervals of the faces, hence rays cannot slip through
/// where faces meet.
///
/// Computed in double in the *canonical* space, where the radius is 1, relative to its origin (of a
/// cone: the apex). Far rays are first moved to where they are nearest to that, and the
/// discriminant comes from the distance between line and axis or center: neither far nor tiny
/// solids lose their outline to cancellation. Ref: Haines, Günther, Akenine-Möller 2019,
/// "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7.
class Quadric final : public PrimitiveSet {
  public:
    /// Largest distortion, ratio of radius to height and such; what is more uneven has no quadric.
    static constexpr double largest_ratio = 0x1p20;

    /// Nothing for gprims of flat faces, for maps without an inverse and beyond largest_ratio.
    static std::shared_ptr<const Quadric> make(const scene::Gprim& gprim);

    const char* kind() const override;

    uint32_t size() const override { return 1; }

    PrimitiveBounds bounds(uint32_t) const override { return bounds_; }

    std::optional<PrimitiveHit> intersect(uint32_t,
                                          const Vec3d& o,
                                          const Vec3d& d,
                                          float t_max) const override;

    PrimitiveSurface surface(uint32_t,
                             const Vec3d& o,
                             const Vec3d& d,
                             const PrimitiveHit& hit) const override;

    bool tangents(uint32_t,
                  uint32_t face,
                  const Vec3d& p,
                  const PrimitiveHit&,
                  Vec3d& dpdu,
                  Vec3d& dpdv) const override;

    size_t bytes() const override { return sizeof(*this); }

    bool is_convex() const override { return true; }

    double area(uint32_t) const override;

    Vec3d point(uint32_t, const Vec2d& u) const override;

  private:
    enum Face : uint32_t { Side, Lower, Upper };

    /// Interval of t in which a line is inside of something, and the faces at its ends.
    struct Span {
        double t[2];
        Face face[2] = {Side, Side};
    };

    /// A ray in canonical space that begins where t = moved.
    struct Line {
        Vec3d o, d;
        double moved = 0;
    };

    Quadric() = default;

    bool set_map(const Mat4d& shape_from_gprim, double radius);
    void set_bounds();
    Vec3d to_canonical(const Vec3d& v) const;
    Vec3d from_canonical(const Vec3d& v) const;
    Line line(const Vec3d& o, const Vec3d& d) const;

    static bool intersect_sphere(const Line& line, double z, bool is_certain, Span& span);
    static bool intersect_tube(const Line& line, Span& span);
    static bool intersect_slab(double o, double d, double lower, double upper, Span& span);
    static bool intersect_both(const Span& a, Span& b);
    bool intersect_cone(const Line& line, Span& span) const;
    bool intersect_capsule(const Line& line, Span& span) const;
    bool intersect_primitive(const Line& line, Span& span) const;

    Vec3d put_on(Face face, const Vec3d& p) const;
    Vec3d canonical_normal(Face face, const Vec3d& p, Vec3d& by_p) const;

    scene::Gprim::Kind kind_ = scene::Gprim::Kind::Sphere;
    double half_ = 0;    ///< half the height of the side; of a cone all of it; in radii
    double reach2_ = 1;  ///< square of the largest distance of a point from the canonical origin
    Vec3d origin_ = Vec3d(0.0);  ///< of canonical space, in shape space
    Mat3d forward_, backward_;   ///< directions from canonical to shape space and back
    Mat3d round_trip_;           ///< |backward|·|forward|
    double slack_ = 0;
    PrimitiveBounds bounds_;
};

}  // namespace velatura::geometry
