// SPDX-License-Identifier: Apache-2.0
#include "geometry/displacement.h"

#include "base/tasks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace velatura::geometry {

namespace {

/// A corner of a triangle.
struct Corner {
    uint32_t triangle = 0;
    uint32_t k = 0;
};

using Triangles = std::vector<std::array<uint32_t, 3>>;

Vec3d unit_or_zero(const Vec3d& v) {
    const double length = v.length();
    return length > 0.0 && std::isfinite(length) ? v / length : Vec3d(0.0);
}

/// [vertex] normals of the triangles around, weighted by their angles.
/// Ref: Thürmer, Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", JGT 3(1).
std::vector<Vec3d> smooth_normals(const std::vector<Vec3>& positions, const Triangles& triangles) {
    std::vector<Vec3d> normals(positions.size(), Vec3d(0.0));
    for (const auto& triangle : triangles)
        for (size_t k = 0; k < 3; ++k) {
            const Vec3d p(positions[triangle[k]]);
            const Vec3d e = Vec3d(positions[triangle[(k + 1) % 3]]) - p;
            const Vec3d f = Vec3d(positions[triangle[(k + 2) % 3]]) - p;
            const Vec3d n = e.cross(f);
            const double length = n.length();
            if (length > 0.0) normals[triangle[k]] += n * (std::atan2(length, e.dot(f)) / length);
        }
    return normals;
}

class Mover {
  public:
    Mover(TriangleMesh mesh,
          std::span<const std::array<uint32_t, 2>> twins,
          const scene::Shape& shape,
          const Displacer& displacer,
          const Mat4d& render_from_shape)
        : mesh_(std::move(mesh)), twins_(twins), shape_(shape), displacer_(displacer) {
        // A matrix that leaves no volume says nothing
        const double determinant = determinant3(render_from_shape);
        const Mat4d matrix = determinant != 0.0 ? render_from_shape : Mat4d();
        const bool is_inward = shape.flip_normals != (determinant < 0.0);
        normal_matrix_ = cofactor_matrix(matrix) * (is_inward ? -1.0 : 1.0);
        shape_from_render_ = matrix.inverse();
        leaders_.resize(mesh_.positions().size());
        std::iota(leaders_.begin(), leaders_.end(), 0u);
        for (const auto& [twin, leader] : twins) leaders_[twin] = leader;
    }

    TriangleMeshData run() {
        const std::vector<double> amounts = point_amounts();
        TriangleMeshData data = std::move(mesh_).release();
        // Normals by corner or face tell nothing about points as a whole
        const bool has_own = data.normal_interpolation == scene::Interpolation::Vertex &&
                             data.normal_indices.empty() &&
                             data.normals.size() == data.positions.size();
        const bool is_faceted = data.normals.empty();
        std::vector<Vec3> no_normals;
        move(amounts, data.triangles, has_own, is_faceted, data.positions, data.normals);
        data.later_normals.resize(is_faceted ? 0 : data.later_positions.size(), data.normals);
        for (size_t k = 0; k < data.later_positions.size(); ++k)
            move(amounts, data.triangles, has_own, is_faceted, data.later_positions[k],
                 is_faceted ? no_normals : data.later_normals[k]);
        data.normal_interpolation = scene::Interpolation::Vertex;
        data.normal_indices.clear();
        return data;
    }

  private:
    /// The corners to look at: one of each vertex where that says it all.
    std::vector<Corner> corners() const {
        const auto is_by_corner = [](const scene::Primvar& primvar) {
            return primvar.interpolation == scene::Interpolation::FaceVarying ||
                   primvar.interpolation == scene::Interpolation::Uniform;
        };
        const auto& mesh = std::get<scene::Mesh>(shape_.geometry);
        const bool wants_all =
            !mesh.face_materials.empty() ||
            std::any_of(mesh_.primvars().begin(), mesh_.primvars().end(), is_by_corner);
        std::vector<bool> is_seen(mesh_.positions().size());
        std::vector<Corner> corners;
        for (uint32_t t = 0; t < mesh_.triangle_count(); ++t)
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t vertex = mesh_.vertices(t)[k];
                if (wants_all || !is_seen[vertex]) corners.push_back({t, k});
                is_seen[vertex] = true;
            }
        return corners;
    }

    double amount_at(const Corner& corner) const {
        SurfacePoint point;
        point.mesh = &mesh_;
        point.triangle = corner.triangle;
        point.b1 = corner.k == 1 ? 1.0f : 0.0f;
        point.b2 = corner.k == 2 ? 1.0f : 0.0f;
        point.material = mesh_.material(corner.triangle);
        if (!displacer_.displaces(point.material)) return 0.0;
        const auto p = [&](int k) { return Vec3d(mesh_.corner(corner.triangle, k)); };
        const Vec3d across = (p(1) - p(0)).cross(p(2) - p(0));
        point.p = mesh_.corner(corner.triangle, int(corner.k));
        point.p_error = Vec3(0.0f);
        const Vec3d normal =
            mesh_.has_normals() ? mesh_.normal(point.triangle, point.b1, point.b2) : across;
        point.ng = to_float(unit_or_zero(across * normal_matrix_));
        point.ns = to_float(unit_or_zero(normal * normal_matrix_));
        return double(displacer_.displacement(point, float(std::sqrt(across.length()))));
    }

    /// [vertex] how far it moves; the same for all copies of a point.
    std::vector<double> point_amounts() const {
        const std::vector<Corner> list = corners();
        std::vector<double> found(list.size());
        constexpr size_t grain = 1024;
        parallel_for(
            list.size(), [&](size_t i) { found[i] = amount_at(list[i]); }, grain);
        std::vector<double> sums(leaders_.size(), 0.0);
        std::vector<uint32_t> counts(leaders_.size(), 0);
        for (size_t i = 0; i < list.size(); ++i) {
            const uint32_t leader = leaders_[mesh_.vertices(list[i].triangle)[list[i].k]];
            sums[leader] += found[i];
            ++counts[leader];
        }
        std::vector<double> amounts(leaders_.size(), 0.0);
        for (size_t v = 0; v < amounts.size(); ++v)
            if (counts[leaders_[v]] > 0) amounts[v] = sums[leaders_[v]] / counts[leaders_[v]];
        return amounts;
    }

    /// Moves one key and makes its normals anew.
    void move(const std::vector<double>& amounts,
              const Triangles& triangles,
              bool has_own_normals,
              bool is_faceted,
              std::vector<Vec3>& positions,
              std::vector<Vec3>& normals) const {
        const size_t count = positions.size();
        std::vector<Vec3d> before(count);
        if (has_own_normals)
            for (size_t v = 0; v < count; ++v) before[v] = Vec3d(normals[v]);
        else
            before = smooth_normals(positions, triangles);
        std::vector<Vec3d> along(count, Vec3d(0.0));
        for (size_t v = 0; v < count; ++v) along[leaders_[v]] += unit_or_zero(before[v]);
        for (size_t v = 0; v < count; ++v)
            if (leaders_[v] == v)
                positions[v] = to_float(Vec3d(positions[v]) + shape_offset(along[v]) * amounts[v]);
        for (const auto& [twin, leader] : twins_) positions[twin] = positions[leader];
        if (!is_faceted) normals = normals_after(before, smooth_normals(positions, triangles));
    }

    /// What a step of 1 along the normal in render space is in shape space.
    Vec3d shape_offset(const Vec3d& normal) const {
        const Vec3d n = unit_or_zero(unit_or_zero(normal) * normal_matrix_);
        return transform_direction(n, shape_from_render_);
    }

    /// Copies of a point whose normals were one have one again.
    std::vector<Vec3> normals_after(const std::vector<Vec3d>& before,
                                    const std::vector<Vec3d>& after) const {
        constexpr double alike = 0.9999;  // cosine of 0.8 degrees
        std::vector<Vec3d> sums = after;
        std::vector<std::array<uint32_t, 2>> pairs;  // leader, copy
        for (const auto& [twin, leader] : twins_) pairs.push_back({leader, twin});
        std::sort(pairs.begin(), pairs.end());
        for (size_t i = 0, end = 0; i < pairs.size(); i = end) {
            std::vector<uint32_t> copies = {pairs[i][0]};
            for (end = i; end < pairs.size() && pairs[end][0] == pairs[i][0]; ++end)
                copies.push_back(pairs[end][1]);
            for (const uint32_t a : copies) {
                sums[a] = Vec3d(0.0);
                for (const uint32_t b : copies)
                    if (a == b || unit_or_zero(before[a]).dot(unit_or_zero(before[b])) > alike)
                        sums[a] += after[b];
            }
        }
        std::vector<Vec3> normals(sums.size());
        for (size_t v = 0; v < sums.size(); ++v) normals[v] = to_float(unit_or_zero(sums[v]));
        return normals;
    }

    TriangleMesh mesh_;
    std::span<const std::array<uint32_t, 2>> twins_;
    const scene::Shape& shape_;
    const Displacer& displacer_;
    Mat3d normal_matrix_;  // towards the outside
    Mat4d shape_from_render_;
    std::vector<uint32_t> leaders_;  // [vertex]
};

}  // namespace

bool is_displaced(const scene::Shape& shape, const Displacer& displacer) {
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    if (mesh == nullptr) return false;
    if (mesh->face_materials.empty()) return displacer.displaces(shape.material);
    return std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(),
                       [&](scene::MaterialId m) { return displacer.displaces(m); });
}

TriangleMeshData displaced(TriangleMeshData data,
                           std::span<const std::array<uint32_t, 2>> twins,
                           const scene::Shape& shape,
                           const Displacer& displacer,
                           const Mat4d& render_from_shape) {
    // Materials by face as the finished mesh will have them
    data.face_materials = std::get<scene::Mesh>(shape.geometry).face_materials;
    data.material = shape.material;
    return Mover(TriangleMesh(std::move(data)), twins, shape, displacer, render_from_shape).run();
}

}  // namespace velatura::geometry
