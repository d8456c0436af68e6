// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/motion.h"
#include "geometry/primitive_set.h"
#include "scene/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace velatura::geometry {

/// The parts of a TriangleMesh; see make_triangle_mesh (tessellate.h), which fills them.
struct TriangleMeshData {
    std::vector<Vec3> positions;  ///< [vertex], shape space
    /// [key − 1][vertex] the same at the later keys of a mesh that moves: key k at k/size() of the
    /// shutter, points straight on between (motion.h). Empty = it does not.
    std::vector<std::vector<Vec3>> later_positions;
    std::vector<std::array<uint32_t, 3>>
        triangles;                                  ///< [triangle] vertex indices, authored winding
    std::vector<uint32_t> faces;                    ///< [triangle] authored face; empty = identity
    std::vector<std::array<uint32_t, 3>> corners;   ///< [triangle] authored corners; empty = none
                                                    ///< asked for by a face-varying primvar
    std::vector<scene::MaterialId> face_materials;  ///< [face]; empty = `material` everywhere
    scene::MaterialId material = scene::none;
    std::vector<Vec3> normals;                     ///< rows of any length; empty = faceted
    std::vector<std::vector<Vec3>> later_normals;  ///< as later_positions; empty = `normals` always
    std::vector<uint32_t> normal_indices;          ///< as scene::Primvar::indices
    scene::Interpolation normal_interpolation = scene::Interpolation::Vertex;
    std::vector<scene::Primvar> primvars;
    bool flip_normals = false;
    std::shared_ptr<const PrimitiveSet> primitives;  ///< then no triangles, and flip_normals says
                                                     ///< that their outside is the shape's inside
};

/// Memory that the vectors hold.
size_t bytes_of(const TriangleMeshData& data);

/// Triangles of one shape, in shape space: what accel builds over and what shading reads. No
/// triangle has two equal corners unless it moves. A shape of primitives has none; of it this holds
/// what is the same everywhere. Immutable but for the choice of texture coordinates.
class TriangleMesh {
  public:
    TriangleMesh() = default;
    explicit TriangleMesh(TriangleMeshData data);

    /// The parts back, as they were taken over.
    TriangleMeshData release() && { return std::move(data_); }

    size_t triangle_count() const { return data_.triangles.size(); }

    /// What the shape is instead of triangles; null for triangles. Hit::triangle counts these then.
    const PrimitiveSet* primitives() const { return data_.primitives.get(); }

    /// The same, to be kept.
    const std::shared_ptr<const PrimitiveSet>& shared_primitives() const {
        return data_.primitives;
    }

    std::span<const Vec3> positions() const { return data_.positions; }

    std::span<const std::array<uint32_t, 3>> triangles() const { return data_.triangles; }

    const std::array<uint32_t, 3>& vertices(uint32_t triangle) const {
        return data_.triangles[triangle];
    }

    /// Segments of its motion; 0 = does not move.
    uint32_t segments() const { return uint32_t(data_.later_positions.size()); }

    /// [segment] positions at the end of each.
    std::span<const std::vector<Vec3>> later_positions() const { return data_.later_positions; }

    /// Corner k of the triangle: weight 1 − b1 − b2, b1, b2 for k = 0, 1, 2. time: see Ray::time.
    Vec3 corner(uint32_t triangle, int k, float time = 0) const {
        const uint32_t vertex = data_.triangles[triangle][size_t(k)];
        return segments() == 0 ? data_.positions[vertex] : moved_position(vertex, time);
    }

    /// Authored polygon that the triangle is a piece of.
    uint32_t face(uint32_t triangle) const {
        return data_.faces.empty() ? triangle : data_.faces[triangle];
    }

    scene::MaterialId material(uint32_t triangle) const {
        return data_.face_materials.empty() ? data_.material : data_.face_materials[face(triangle)];
    }

    /// Whether the outside is on the side from which the corners run clockwise.
    bool flip_normals() const { return data_.flip_normals; }

    bool has_normals() const { return !data_.normals.empty(); }

    /// Interpolated shading normal in shape space, not normalized; zero when the mesh is faceted.
    /// Between keys normals go straight on, as points do.
    Vec3d normal(uint32_t triangle, float b1, float b2, float time = 0) const;

    /// Shading normals of the three corners in shape space, not normalized; false when the mesh is
    /// faceted or one of them is missing.
    bool corner_normals(uint32_t triangle, Vec3d out[3], float time = 0) const;

    bool has_primvar(scene::PrimvarId id) const { return find(id) != nullptr; }

    /// Whether what an instance hands down under this name counts: the mesh has none of its own.
    bool yields_to_instance(scene::PrimvarId id) const {
        const scene::Primvar* primvar = find(id);
        return primvar == nullptr || primvar->yields_to_instance;
    }

    /// Interpolates a primvar; writes its `width` floats and leaves the rest of `out` alone.
    /// Returns: false when the mesh has no such primvar or its numbers do not reach this triangle.
    /// Of primitives: b1, b2 are PrimitiveHit::u, v.
    bool primvar(scene::PrimvarId id, uint32_t triangle, float b1, float b2, float out[4]) const;

    /// Rows of the primvar at the three corners; false as above.
    bool primvar_corners(scene::PrimvarId id, uint32_t triangle, float out[3][4]) const;

    /// Texture coordinates that tangents follow when the material does not name others.
    scene::PrimvarId texture_coordinates() const { return texture_coordinates_; }

    void set_texture_coordinates(scene::PrimvarId id) { texture_coordinates_ = id; }

    /// Box of the vertices that triangles use, at all times, or of the primitives, shape space;
    /// empty without any.
    const Box3& bounds() const { return bounds_; }

    std::span<const scene::Primvar> primvars() const { return data_.primvars; }

    size_t bytes() const;

  private:
    const scene::Primvar* find(scene::PrimvarId id) const;
    const float* row(const scene::Primvar& primvar, uint32_t triangle, int k) const;
    const float* numbers(const scene::Primvar& primvar, size_t element) const;
    bool primitive_primvar(
        const scene::Primvar& primvar, uint32_t primitive, float u, float v, float out[4]) const;
    void extend_bounds(const std::vector<Vec3>& positions);
    Vec3 moved_position(uint32_t vertex, float time) const;
    bool corner_normal(uint32_t triangle, int k, float time, Vec3d& n) const;
    uint32_t element(scene::Interpolation interpolation, uint32_t triangle, int k) const;

    TriangleMeshData data_;
    Box3 bounds_;
    scene::PrimvarId texture_coordinates_ = scene::none;
};

}  // namespace velatura::geometry
