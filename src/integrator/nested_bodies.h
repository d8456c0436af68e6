// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "integrator/body_trees.h"
#include "integrator/interior.h"
#include "integrator/ray_counts.h"
#include "scene/scene.h"
#include "shading/material_evaluator.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// Bodies that overlap, touch or lie in each other: which of their faces are boundaries at all, and
/// of what (docs/adr/0025). Made only for scenes with priorities. Immutable, safe to share among
/// threads; what it was made from must outlive it.
/// Ref: Schmidt & Budge 2002, "Simple Nested Dielectrics in Ray Traced Images".
class NestedBodies {
  public:
    NestedBodies(const scene::Scene& scene,
                 const geometry::GeometrySet& geometry,
                 const shading::MaterialEvaluator& materials);

    /// Faces of different bodies that lie on each other, as near as rounding tells; the first is
    /// the one that was asked for. Those beyond the last do not count.
    struct Faces {
        std::array<geometry::SurfacePoint, 4> face;
        size_t count = 0;

        const geometry::SurfacePoint* begin() const { return face.data(); }

        const geometry::SurfacePoint* end() const { return face.data() + count; }

        bool is_full() const { return count == face.size(); }

        void add(const geometry::SurfacePoint& point) { face[count++] = point; }
    };

    /// What a ray meets where it meets a face.
    struct Crossing {
        /// Something else is behind than before. Else the ray goes on, and has met nothing.
        bool is_boundary = false;
        /// The face that light scatters at, which may be another one than the one that was met.
        /// Rays leave far enough from it to meet none of those that lie there.
        geometry::SurfacePoint point;
        float surrounding_index = 1;  ///< see MaterialEvaluator::make_bsdf
        Interior beyond;              ///< where light is that goes through
    };

    /// inside: on the side of wo. point: of a material that bounds a body. counts: null = none.
    Crossing cross(const Interior& inside,
                   const geometry::SurfacePoint& point,
                   const Vec3& wo,
                   RayCounts* counts) const;

    Faces faces_at(const geometry::SurfacePoint& point) const;

    /// The point with rays that leave beyond all faces of faces_at().
    static geometry::SurfacePoint clear_of_faces(const geometry::SurfacePoint& point);

    size_t bytes() const;

  private:
    /// A shape that is placed, and bounds a body somewhere.
    struct Body {
        PlacedBody placed;
        Box3d box;  ///< render space, wherever it moves
    };

    void add_bodies(uint32_t instance, uint32_t prototype);
    bool bounds_body(const scene::Shape& shape, scene::MaterialId override_material) const;
    bool find_face(const Body& body, const geometry::Ray& probe, geometry::SurfacePoint& out) const;

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    const shading::MaterialEvaluator& materials_;
    std::vector<Body> bodies_;
    BodyTrees trees_;
};

}  // namespace velatura::integrator
