// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/triangle_mesh.h"
#include "scene/mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace velatura::geometry {

struct TessellationOptions {
    int segments =
        96;  ///< around the axis of a quadric; half as many from pole to pole; at least 4
    bool all_quadrics = false;  ///< GeometrySet: also those that rays could meet as they are
};

/// Triangles of a shape, in shape space. Polygons: triangles as they are, convex quads along the
/// shorter diagonal (the one from corner 0 on ties), the rest by ear clipping in the coordinate
/// plane that the polygon faces most; of a polygon that moves all that as it is first. Quadrics:
/// points exactly on the surface up to rounding, exact normals, closed; computed in double, cast at
/// the end. Triangles with two equal corners are dropped unless they move; authored faces keep
/// their numbers. Exact under scaling of the shape by powers of two.
TriangleMesh make_triangle_mesh(const scene::Shape& shape, const TessellationOptions& options = {});

/// The same before it is a mesh, without material and sides.
TriangleMeshData make_triangles(const scene::Shape& shape, const TessellationOptions& options = {});

/// Triangles that were made of a mesh elsewhere, as a shape.
TriangleMesh make_triangle_mesh(const scene::Shape& shape, TriangleMeshData data);

/// A shape that rays meet as the quadric, the curves or the points that it is: without triangles.
/// Nothing for other shapes and where Quadric::make has none; curves and points of which nothing
/// can be met have neither.
std::optional<TriangleMesh> make_primitive_mesh(const scene::Shape& shape);

/// Appends corner triples (0 … polygon.size() − 1) that cover the polygon, in its winding.
/// Ref: Meisters 1975, "Polygons Have Ears"; a self-crossing polygon still gives polygon.size() − 2
/// triangles.
void triangulate_polygon(std::span<const Vec3> polygon, std::vector<std::array<uint32_t, 3>>& out);

}  // namespace velatura::geometry
