// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/mesh.h"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace velatura::geometry {

/// Where a ray meets a primitive.
struct PrimitiveHit {
    double t = 0;        ///< of the ray as it was given, in multiples of |d|
    float u = 0, v = 0;  ///< the primitive's own parameters; come back in Hit::b1 and Hit::b2
};

/// Where a primitive lies.
struct PrimitiveBounds {
    Box3d box;  ///< holds every point that intersect() finds, rounding included
    /// How much more than a triangle's the place of a far ray may be off: the box counts as larger
    /// by 2^-46·condition times the distance to the origin of the ray. At least 1.
    double condition = 1;
};

/// What shading needs to know where a ray meets a primitive, in the set's space.
struct PrimitiveSurface {
    Vec3d p;      ///< on the surface but for double rounding
    Vec3d error;  ///< bound of what rounding, also that of rays, may move p off the surface
    Vec3d n;      ///< towards the outside, not unit, not zero
    /// Of a surface whose n goes over smoothly where its own normal does not: its own. Zero: n is.
    Vec3d facet_n = Vec3d(0.0);
    Mat3d normal_by_p;  ///< derivative of n by p (row vectors: dn = dp · M), along the surface
    uint32_t face = 0;  ///< side, cap …
};

/// What a primvar's value at a place is made of: the sum of weights times rows.
struct PrimvarRows {
    uint32_t row[4] = {0, 0, 0, 0};
    float weight[4] = {1, 0, 0, 0};
    int count = 1;
};

/// A place on a thin strand, in the set's space; not unit.
struct PrimitiveFiber {
    Vec3d middle;  ///< on the axis of a round one, halfway between the edges of a flat one
    Vec3d along;   ///< from root to tip
    Vec3d side = Vec3d(0.0);  ///< of a flat one: from edge to edge
};

/// Primitives that are not triangles: they say themselves where rays meet them. An accelerator
/// keeps them in its trees beside triangles, under instances too. Plugins may bring other kinds.
/// Immutable, safe to share among threads. Everything is a function of the arguments alone, to the
/// bit: that is what makes images independent of trees, threads and instruction sets.
/// Rays are o + t·d in the space of the set, in double, finite, d not zero and not unit.
class PrimitiveSet {
  public:
    virtual ~PrimitiveSet() = default;

    /// What they are called in statistics: sphere …
    virtual const char* kind() const = 0;

    /// Number of primitives; they go by 0 … size() − 1.
    virtual uint32_t size() const = 0;

    /// An empty box leaves the primitive out.
    virtual PrimitiveBounds bounds(uint32_t index) const = 0;

    /// The first point with 0 < t < t_max, t compared as the float that it becomes.
    virtual std::optional<PrimitiveHit> intersect(uint32_t index,
                                                  const Vec3d& o,
                                                  const Vec3d& d,
                                                  float t_max) const = 0;

    /// Whether there is one.
    virtual bool is_occluded(uint32_t index, const Vec3d& o, const Vec3d& d, float t_max) const {
        return intersect(index, o, d, t_max).has_value();
    }

    /// The surface where the ray meets the primitive nearest to hit.t, which need not be exact and,
    /// of an origin on the surface, may be there. Only for rays that meet it.
    virtual PrimitiveSurface surface(uint32_t index,
                                     const Vec3d& o,
                                     const Vec3d& d,
                                     const PrimitiveHit& hit) const = 0;

    /// How texture coordinates would run over the surface near p; not unit. False: no such thing.
    /// hit: as intersect() returned it, but for t.
    virtual bool tangents(uint32_t index,
                          uint32_t face,
                          const Vec3d& p,
                          const PrimitiveHit& hit,
                          Vec3d& dpdu,
                          Vec3d& dpdv) const = 0;

    /// False: no strand. hit: as above.
    virtual bool fiber(uint32_t, const PrimitiveHit&, PrimitiveFiber&) const { return false; }

    /// Rows of primvars that are not the same everywhere. hit: as above.
    virtual PrimvarRows primvar_rows(uint32_t index,
                                     scene::Interpolation interpolation,
                                     const PrimitiveHit& hit) const;

    /// Memory that it holds.
    virtual size_t bytes() const = 0;

    /// Whether every one of them is convex: no line meets it more than twice.
    virtual bool is_convex() const { return false; }

    /// Area of one side, about.
    virtual double area(uint32_t index) const = 0;

    /// A point of the surface, about evenly by area. u: in [0, 1).
    virtual Vec3d point(uint32_t index, const Vec2d& u) const = 0;
};

inline PrimvarRows PrimitiveSet::primvar_rows(uint32_t,
                                              scene::Interpolation,
                                              const PrimitiveHit&) const {
    return {};
}

}  // namespace velatura::geometry
