// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"
#include "scene/linking.h"
#include "scene/subdivision.h"
#include "scene/voxel_grid.h"

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

namespace velatura::scene {

/// UsdGeomPrimvar interpolation; Vertex and Varying differ only under subdivision.
enum class Interpolation : uint8_t { Constant, Uniform, Varying, Vertex, FaceVarying };

/// Numbers carried by a mesh. `values` holds rows of `width` floats; row i belongs to element i, or
/// to element e with indices[e] == i when `indices` is not empty.
struct Primvar {
    PrimvarId name = none;
    Interpolation interpolation = Interpolation::Constant;
    uint8_t width = 1;  ///< floats per row: 1, 2, 3 or 4
    /// Inherited from above the prototype of a point instancer: what the instance hands down under
    /// the same name counts before it.
    bool yields_to_instance = false;
    std::vector<float> values;      ///< [row][width]
    std::vector<uint32_t> indices;  ///< [element]; empty = identity
};

/// Polygons as authored, in shape space. Indices are valid, counts >= 3 and finite points are
/// promised by `translate`, which drops what is broken with a warning.
struct Mesh {
    std::vector<Vec3> points;  ///< [vertex]
    /// [key − 1][vertex] points at the later keys of a mesh that moves, at equal steps over the
    /// shutter, the last one when it closes; points go straight on between. Empty = the mesh does
    /// not move.
    std::vector<std::vector<Vec3>> later_points;
    std::vector<uint32_t> face_vertex_counts;      ///< [face]
    std::vector<uint32_t> face_vertex_indices;     ///< [corner]
    std::vector<MaterialId> face_materials;        ///< [face]; empty = Shape::material everywhere
    std::vector<Vec3> normals;                     ///< rows, unit not promised; empty = faceted
    std::vector<std::vector<Vec3>> later_normals;  ///< as later_points; empty = `normals` always
    std::vector<uint32_t> normal_indices;          ///< as Primvar::indices
    Interpolation normal_interpolation = Interpolation::Vertex;
    std::vector<Primvar> primvars;  ///< st, displayColor, …
    /// With a scheme: what to render is the limit surface, and `normals` belong to the polygons
    /// that stand for it where nothing can make it.
    SubdivisionScheme subdivision = SubdivisionScheme::None;
    SubdivisionRules rules;
};

/// Quadrics in their own space, axis Z; `shape_from_gprim` carries axis, transform and everything
/// affine. Sizes are those of the UsdGeom gprims (Cube: edge; Cylinder, Cone, Capsule: height
/// without caps, radius).
struct Gprim {
    enum class Kind : uint8_t { Sphere, Cube, Cylinder, Cone, Capsule, Plane };
    Kind kind = Kind::Sphere;
    double radius = 1.0;
    double height = 2.0;
    double size = 2.0;              ///< Cube
    double width = 2.0;             ///< Plane: along x
    double length = 2.0;            ///< Plane: along y
    Mat4d shape_from_gprim;         ///< into shape space, in double
    std::vector<Primvar> primvars;  ///< constant ones only
};

/// Strands of linear or cubic curves, in the space of `shape_from_curves`: round ones of the given
/// width, or, with normals, ribbons as wide that face them. What makes no curve is left out by
/// `translate`: see curves.h for how many vertices a curve may have.
struct Curves {
    enum class Basis : uint8_t { Linear, Bezier, Bspline, CatmullRom };
    enum class Wrap : uint8_t { Nonperiodic, Periodic, Pinned };
    Basis basis = Basis::Bezier;
    Wrap wrap = Wrap::Nonperiodic;
    std::vector<Vec3> points;             ///< [vertex]
    std::vector<uint32_t> vertex_counts;  ///< [curve]
    std::vector<float> widths;            ///< rows, finite, not negative
    Interpolation width_interpolation = Interpolation::Constant;
    std::vector<Vec3> normals;  ///< rows, unit not promised; empty = round
    Interpolation normal_interpolation = Interpolation::Vertex;
    Mat4d shape_from_curves;        ///< the identity unless it makes ellipses of circles
    std::vector<Primvar> primvars;  ///< Uniform: by curve
};

/// Balls in the space of `shape_from_points`.
struct Points {
    std::vector<Vec3> points;
    std::vector<float> widths;      ///< one for all, or [point]; finite, not negative
    Mat4d shape_from_points;        ///< the identity unless it makes ellipsoids of balls
    std::vector<Primvar> primvars;  ///< Varying, Vertex: by point
};

/// The surface where the numbers of a grid go through 0; inside they are below it.
struct LevelSet {
    std::shared_ptr<const VoxelGrid> grid;  ///< of one channel
    Mat4d shape_from_lattice;
    std::vector<Primvar> primvars;  ///< constant ones only
};

/// Geometry with what a ray hit needs to know about it. Shape space is render space for shapes
/// placed directly, and the space of the prototype for shapes of a prototype.
struct Shape {
    std::variant<Mesh, Gprim, Curves, Points, LevelSet> geometry;
    MaterialId material = none;  ///< none = displayColor / displayOpacity material
    bool flip_normals = false;   ///< geometric normal against the winding: leftHanded xor mirrored
                                 ///< shape transform; of curves and points: leftHanded
    bool double_sided = false;
    MeshLightId light = none;  ///< the shape is this light
    LinkClass link = 0;  ///< of a shape placed directly; for the others see Instance::link_row
    ProvenanceId provenance = none;
};

}  // namespace velatura::scene
