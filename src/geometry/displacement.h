// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/surface_point.h"
#include "geometry/triangle_mesh.h"
#include "scene/mesh.h"

#include <array>
#include <cstdint>
#include <span>

namespace velatura::geometry {

/// What knows how far materials move their surfaces. Thread-safe.
class Displacer {
  public:
    virtual ~Displacer() = default;

    /// Whether surfaces of the material move anywhere.
    virtual bool displaces(scene::MaterialId material) const = 0;

    /// How far the surface moves along its normal, in render space; finite. Of the point only mesh,
    /// triangle, weights, material, p in shape space and the normals in render space count, and its
    /// mesh stands where it was. footprint: distance of the points that are asked for, in shape
    /// space.
    virtual float displacement(const SurfacePoint& point, float footprint) const = 0;
};

/// Whether some face of the shape moves.
bool is_displaced(const scene::Shape& shape, const Displacer& displacer);

/// Moves the vertices of a mesh along its normals, and makes its shading normals those of what
/// comes out. `twins`: as in DicedMesh. All copies of one point move alike, by the mean of what is
/// found at its corners in the triangles around it, along the mean of their normals: what was
/// closed stays closed. Faceted meshes stay faceted. render_from_shape: leads to where amounts are
/// measured.
TriangleMeshData displaced(TriangleMeshData data,
                           std::span<const std::array<uint32_t, 2>> twins,
                           const scene::Shape& shape,
                           const Displacer& displacer,
                           const Mat4d& render_from_shape = Mat4d());

}  // namespace velatura::geometry
