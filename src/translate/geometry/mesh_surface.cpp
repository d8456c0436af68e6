// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/mesh_surface.h"

#include "translate/context/values.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/geometry/primvars.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "translate/motion/velocities.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace velatura::translate::geometry {

namespace {

/// Which point each normal stands at. Normals that many points share get one for each of the
/// corners, since the points may turn apart.
std::vector<uint32_t> spread_normals(const FaceTable& table,
                                     size_t points,
                                     scene::Interpolation& interpolation,
                                     std::vector<Vec3d>& normals) {
    std::vector<uint32_t> owners;
    const bool is_by_point = interpolation == scene::Interpolation::Vertex ||
                             interpolation == scene::Interpolation::Varying;
    if (is_by_point) {
        owners.resize(points);
        std::iota(owners.begin(), owners.end(), 0u);
        return owners;
    }
    owners = table.indices;
    if (interpolation == scene::Interpolation::FaceVarying) return owners;
    std::vector<Vec3d> by_corner(table.indices.size(), Vec3d(0.0));
    for (size_t f = 0; f < table.faces.size(); ++f) {
        const FaceTable::Face& face = table.faces[f];
        const bool is_uniform = interpolation == scene::Interpolation::Uniform;
        for (size_t i = face.first; i < face.first + face.count; ++i)
            by_corner[i] = normals[is_uniform ? f : 0];
    }
    normals = std::move(by_corner);
    interpolation = scene::Interpolation::FaceVarying;
    return owners;
}

/// Authored normals, `primvars:normals` before `normals`; false when there are none that fit.
/// `matrix` leads from where `pose` leaves the points.
bool read_normals(Context& ctx,
                  Prim prim,
                  const FaceTable& table,
                  const ElementCounts& counts,
                  const Mat4d& matrix,
                  const motion::Pose* pose,
                  scene::Mesh& mesh) {
    std::optional<usd::stage::Primvar> source;
    const Attribute primvar = prim.attribute("primvars:normals");
    const Attribute plain = prim.attribute("normals");
    if (primvar.has_authored_value())
        source = usd::stage::as_primvar(primvar, usd::stage::Interpolation::Constant);
    else if (plain.has_authored_value())
        source = usd::stage::as_primvar(plain, usd::stage::Interpolation::Vertex);
    if (!source) return false;
    // With points that velocities carry on from a sample stay its normals
    const TimeCode time = motion::has_velocities(ctx, prim)
                              ? motion::held_time(source->attribute, ctx.frame)
                              : ctx.time;
    std::vector<double> rows;
    int width = 0;
    const bool is_readable = read_rows(source->attribute.value(time), rows, width) && width == 3;
    // usd and scene list their interpolations in one order
    auto interpolation = scene::Interpolation(int(source->interpolation));
    const size_t expected = element_count(counts, interpolation);
    std::vector<int> indices =
        source->is_indexed() ? source->index_values(time) : std::vector<int>();
    const size_t found = indices.empty() ? rows.size() / 3 : indices.size();
    const bool has_good_indices = std::all_of(indices.begin(), indices.end(), [&](int i) {
        return i >= 0 && size_t(i) < rows.size() / 3;
    });
    if (!is_readable || found != expected || !has_good_indices) {
        if (found > 0 || !rows.empty())
            ctx.warn("bad-normals", source->attribute,
                     fmt::format(
                         "{} normals or indices{}, expected {} ({}); they are ignored, the "
                         "mesh falls back to the normals of its {}",
                         found, has_good_indices ? "" : " (some out of range)", expected,
                         usd::stage::interpolation_name(source->interpolation),
                         mesh.subdivision == scene::SubdivisionScheme::None ? "faces" : "surface"));
        return false;
    }
    std::vector<Vec3d> normals;
    for (size_t i = 0; i + 2 < rows.size(); i += 3)
        normals.emplace_back(rows[i], rows[i + 1], rows[i + 2]);
    const auto lost = std::count_if(normals.begin(), normals.end(),
                                    [](const Vec3d& n) { return !std::isfinite(n.dot(n)); });
    if (lost > 0)
        ctx.warn(
            "bad-normals", source->attribute,
            fmt::format("{} of {} normals are not finite; the mesh falls back to the normals "
                        "of its {} there",
                        lost, normals.size(),
                        mesh.subdivision == scene::SubdivisionScheme::None ? "faces" : "surface"));
    if (pose && (pose->skin || pose->has_normal_offsets)) {
        std::vector<Vec3d> rowwise;
        for (const int i : indices) rowwise.push_back(normals[size_t(i)]);
        if (!indices.empty()) normals = std::move(rowwise);
        indices.clear();
        const auto owners = spread_normals(table, counts.points, interpolation, normals);
        pose->deform_normals(normals, owners);
    }
    mesh.normals = transformed_normals(normals, matrix);
    mesh.normal_indices.assign(indices.begin(), indices.end());
    mesh.normal_interpolation = interpolation;
    return true;
}

/// Directions of a smooth surface through the points: face normals weighted by the corners' angles.
/// Ref: Thürmer, Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", JGT 3(1).
std::vector<Vec3d> smooth_normals(const FaceTable& table, const std::vector<Vec3d>& points) {
    std::vector<Vec3d> normals(points.size(), Vec3d(0.0));
    for (const FaceTable::Face& face : table.faces) {
        if (!face.is_kept) continue;
        for (size_t i = 0; i < face.count; ++i) {
            const uint32_t a = table.indices[face.first + i];
            const Vec3d& p = points[a];
            const Vec3d e = points[table.indices[face.first + (i + 1) % face.count]] - p;
            const Vec3d f =
                points[table.indices[face.first + (i + face.count - 1) % face.count]] - p;
            const Vec3d n = e.cross(f);
            const double length = std::sqrt(n.dot(n));
            if (length > 0.0) normals[a] += n * (std::atan2(length, e.dot(f)) / length);
        }
    }
    return normals;
}

}  // namespace

std::vector<Vec3> transformed_normals(const std::vector<Vec3d>& normals, const Mat4d& matrix) {
    const Mat3d cofactors = cofactor_matrix(matrix);
    const double sign = determinant3(matrix) < 0.0 ? -1.0 : 1.0;
    std::vector<Vec3> out;
    out.reserve(normals.size());
    for (const Vec3d& n : normals) {
        const Vec3d m = (n * cofactors) * sign;
        const double length = std::sqrt(m.dot(m));
        out.push_back(length > 0.0 && std::isfinite(length) ? to_float(m / length) : Vec3(0.0f));
    }
    return out;
}

bool set_surface(Context& ctx,
                 Prim prim,
                 const FaceTable& table,
                 const std::vector<Vec3d>& points,
                 const Mat4d& matrix,
                 const motion::Pose* pose,
                 scene::Mesh& mesh) {
    // From where the points are now
    const Mat4d& point_matrix = pose && pose->skin ? pose->matrix : matrix;
    const ElementCounts counts{table.faces.size(), points.size(), table.indices.size()};
    const bool is_smooth = mesh.subdivision == scene::SubdivisionScheme::CatmullClark ||
                           mesh.subdivision == scene::SubdivisionScheme::Loop;
    if (!read_normals(ctx, prim, table, counts, point_matrix, pose, mesh) && is_smooth) {
        // The limit surface is smooth: so is the shading of the polygons that stand for it. Which
        // side is outside is decided in the prim's own space
        const bool is_mirrored = (determinant3(point_matrix) < 0.0) != (determinant3(matrix) < 0.0);
        std::vector<Vec3d> normals = smooth_normals(table, points);
        if (is_mirrored)
            for (Vec3d& n : normals) n = -n;
        mesh.normals = transformed_normals(normals, point_matrix);
        mesh.normal_interpolation = scene::Interpolation::Vertex;
    }

    // Cast to float only now, in the space of the holder
    mesh.points.reserve(points.size());
    size_t overflown = 0;
    for (const Vec3d& p : points) {
        const Vec3 q = to_float(transform_point(p, point_matrix));
        overflown += !is_finite(q) && is_finite(to_float(p));
        mesh.points.push_back(q);
    }
    if (overflown > 0)
        ctx.warn("bad-transform", prim,
                 fmt::format("{} points do not fit a float, the prim is skipped", overflown));
    return overflown == 0;
}

}  // namespace velatura::translate::geometry
