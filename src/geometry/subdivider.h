// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "base/result.h"
#include "geometry/triangle_mesh.h"
#include "scene/mesh.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace velatura::geometry {

/// Under this name and version a plugin hands out a `const Subdivider*`. The version changes
/// whenever this header or a type that it mentions does.
inline constexpr const char* subdivider_interface = "subdivider";
inline constexpr uint32_t subdivider_interface_version = 1;

/// A limit surface cut into triangles.
struct DicedMesh {
    /// Shape space, all keys of a mesh that moves; normals are those of the limit surface, towards
    /// where corners run counter-clockwise, unit or zero. Triangles know their authored face;
    /// primvars are by vertex, but for constant and uniform ones. Material and sides are left out.
    TriangleMeshData data;
    /// Vertices (twin, leader) that are one point of the surface, to the bit, at which normals or
    /// primvars differ between faces; leaders are nobody's twin.
    std::vector<std::array<uint32_t, 2>> twins;
};

/// The surface that the polygons of a mesh become in the limit. What it is made from must outlive
/// it. Functions may be called from many threads, run in parallel themselves, and do not throw.
class LimitSurface {
  public:
    virtual ~LimitSurface() = default;

    /// Edges of the mesh; they go by 0 … edge_count() − 1.
    virtual uint32_t edge_count() const = 0;

    /// [corner of the mesh] the edge from this corner to the next one of its face.
    virtual std::span<const uint32_t> edge_of_corner() const = 0;

    /// [face] whether it is there: not a hole, nor left out by the boundary's rule.
    virtual std::span<const uint8_t> has_face() const = 0;

    /// [edge] limit points at its start, middle and end, as when the shutter opens; not numbers for
    /// edges without a face that is there.
    virtual std::span<const std::array<Vec3, 3>> edge_points() const = 0;

    /// Cuts every edge into rates[edge] pieces (>= 1) and the faces accordingly. Neighbors share
    /// the points of their edge to the bit; the result does not depend on the number of threads.
    /// Errors: "subdivision".
    virtual Result<DicedMesh> dice(std::span<const uint32_t> rates) const = 0;
};

/// What brings subdivision surfaces.
class Subdivider {
  public:
    virtual ~Subdivider() = default;

    /// The surface of a mesh with a scheme, with its motion unless `stays`. Does not throw. Errors:
    /// "subdivision" where the mesh has none; the message says why.
    virtual Result<std::unique_ptr<LimitSurface>> make(const scene::Mesh& mesh,
                                                       bool stays) const = 0;
};

}  // namespace velatura::geometry
