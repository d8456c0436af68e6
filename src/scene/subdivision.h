// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::scene {

/// Whose limit the polygons of a mesh stand for; None = themselves.
enum class SubdivisionScheme : uint8_t { None, CatmullClark, Loop, Bilinear };

/// UsdGeomMesh interpolateBoundary: faces at the boundary are left out, end at a smooth curve, or
/// at one with corners where a vertex has a single face.
enum class BoundaryInterpolation : uint8_t { None, EdgeOnly, EdgeAndCorner };

/// UsdGeomMesh faceVaryingLinearInterpolation: where face-varying numbers are not smooth.
enum class FaceVaryingInterpolation : uint8_t {
    None,
    CornersOnly,
    CornersPlus1,
    CornersPlus2,
    Boundaries,
    All
};

/// UsdGeomMesh triangleSubdivisionRule; Smooth has weights of its own for triangles.
enum class TriangleRule : uint8_t { CatmullClark, Smooth };

/// How the limit surface follows from the polygons, with the fallbacks of UsdGeomMesh. Vertices are
/// those of the mesh, pairs are edges of it: `translate` promises.
struct SubdivisionRules {
    BoundaryInterpolation boundary = BoundaryInterpolation::EdgeAndCorner;
    FaceVaryingInterpolation face_varying = FaceVaryingInterpolation::CornersPlus1;
    TriangleRule triangles = TriangleRule::CatmullClark;
    std::vector<std::array<uint32_t, 2>> creases;  ///< vertices of an edge
    std::vector<float> crease_sharpnesses;         ///< [crease]
    std::vector<uint32_t> corners;                 ///< vertices
    std::vector<float> corner_sharpnesses;         ///< [corner]
    std::vector<uint32_t> holes;  ///< faces that shape the surface and are not there, ascending
};

}  // namespace velatura::scene
