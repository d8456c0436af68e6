// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/triangle_mesh.h"
#include "scene/mesh.h"

namespace velatura::geometry {

/// Triangles of a quadric in shape space, with normals per vertex and without materials or
/// primvars. Windings run counter-clockwise seen from outside in the quadric's own space.
TriangleMeshData tessellate_gprim(const scene::Gprim& gprim, int segments);

}  // namespace velatura::geometry
