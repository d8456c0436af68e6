// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "integrator/interior.h"
#include "integrator/mesh_accelerators.h"
#include "integrator/ray_counts.h"
#include "scene/scene.h"
#include "shading/material_evaluator.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// Nested dielectrics: decides which faces of overlapping, touching or nested solids are
/// boundaries, and between which interiors (docs/adr/0025). Made only for scenes with priorities.
/// Immutable, safe to share among threads; its arguments must outlive it.
/// Ref: Schmidt & Budge 2002, "Simple Nested Dielectrics in Ray Traced Images".
class NestedDielectrics {
  public:
    NestedDielectrics(const scene::Scene& scene,
                      const geometry::GeometrySet& geometry,
                      const shading::MaterialEvaluator& materials);

    /// Coincident faces of different solids, within rounding; the first is the queried one. At most
    /// four; further ones are ignored.
    struct Faces {
        std::array<geometry::SurfacePoint, 4> face;
        size_t count = 0;

        const geometry::SurfacePoint* begin() const { return face.data(); }

        const geometry::SurfacePoint* end() const { return face.data() + count; }

        bool is_full() const { return count == face.size(); }

        void add(const geometry::SurfacePoint& point) { face[count++] = point; }
    };

    /// A ray at a face.
    struct Crossing {
        /// False: the interior does not change; the ray continues without a scattering event.
        bool is_boundary = false;
        /// The face that scatters, possibly another coincident one than the face that was hit. Rays
        /// start far enough from it to hit none of the coincident faces.
        geometry::SurfacePoint point;
        float surrounding_index = 1;  ///< see MaterialEvaluator::make_bsdf
        Interior beyond;              ///< interior behind the face
    };

    /// Crossing of a ray from wo at a face.
    /// Args: inside: interior on the side of wo; point: of a material that bounds a solid; counts:
    ///       of unmatched and too deep faces; null = not counted.
    Crossing cross(const Interior& inside,
                   const geometry::SurfacePoint& point,
                   const Vec3& wo,
                   RayCounts* counts) const;

    /// Coincident faces at a point of a face.
    Faces faces_at(const geometry::SurfacePoint& point) const;

    /// The point, with ray origins beyond all of faces_at().
    static geometry::SurfacePoint clear_of_faces(const geometry::SurfacePoint& point);

    size_t bytes() const;  ///< memory

  private:
    /// A placed shape some of whose faces bound a solid.
    struct Solid {
        PlacedMesh placed;
        Box3d box;  ///< render space, wherever it moves
    };

    void add_dielectrics(uint32_t instance, uint32_t prototype);
    bool bounds_solid(const scene::Shape& shape, scene::MaterialId override_material) const;
    bool find_face(const Solid& solid,
                   const geometry::Ray& probe,
                   geometry::SurfacePoint& out) const;

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    const shading::MaterialEvaluator& materials_;
    std::vector<Solid> solids_;
    MeshAccelerators trees_;
};

}  // namespace velatura::integrator
