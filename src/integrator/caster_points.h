// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"
#include "integrator/caster_shapes.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::integrator {

/// A point of a caster, and the density with which it was sampled.
struct CasterPoint {
    geometry::SurfacePoint point;
    double pdf = 0;  ///< per area [1/scene unit²]
};

/// Random numbers for a point, all in [0, 1).
struct CasterNumbers {
    float u_piece = 0;
    Vec2 u_point = Vec2(0.0f), u_direction = Vec2(0.0f);
};

/// Samples points of surfaces by area: triangles, and convex primitives (spheres, cylinders …).
///
/// Primitives have no map from the unit square to their surface that keeps areas. A line that is
/// uniform among those through a ball around the primitive enters a convex one at a point that is
/// uniform over its surface (Cauchy-Crofton; Santaló 1976, "Integral Geometry and Geometric
/// Probability", section 14.3). A line that misses it is a sample without value.
class CasterPoints {
  public:
    CasterPoints(const World& world, std::vector<double> material_weights)
        : world_(world), shapes_(world, std::move(material_weights)) {}

    bool is_empty() const { return shapes_.casters().empty(); }

    const CasterShapes& shapes() const { return shapes_; }

    /// True when sample() can return this point.
    bool holds(const geometry::SurfacePoint& point) const {
        if (!(shapes_.weight(point.material) > 0.0)) return false;
        const geometry::PrimitiveSet* primitives = point.mesh->primitives();
        return !primitives || primitives->is_convex();
    }

    /// A point of one of shapes().casters().
    /// time: of the shutter, see Ray::time. nullopt: a sample without value.
    std::optional<CasterPoint> sample(uint32_t caster,
                                      const CasterNumbers& numbers,
                                      float time) const;

  private:
    /// A triangle or a primitive where it stands at a time.
    struct Piece {
        const geometry::TriangleMesh& mesh;
        geometry::Hit hit;  ///< of it; where is still to be filled in
        Mat4d render_from_shape;
        float time = 0;
    };

    std::optional<CasterPoint> triangle_point(Piece piece, const CasterNumbers& numbers) const;
    std::optional<CasterPoint> primitive_point(Piece piece, const CasterNumbers& numbers) const;
    geometry::SurfacePoint point_at(const Piece& piece, const Vec3d& o, const Vec3d& d) const;

    const World& world_;
    CasterShapes shapes_;
};

}  // namespace velatura::integrator
