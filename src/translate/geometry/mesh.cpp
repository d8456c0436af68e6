// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/mesh.h"

#include "translate/context/instance_source.h"
#include "translate/context/missing_values.h"
#include "translate/context/values.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/geometry/mesh_motion.h"
#include "translate/geometry/mesh_surface.h"
#include "translate/geometry/primvars.h"
#include "translate/geometry/subdivision.h"
#include "translate/materials/materials.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "translate/motion/unblurred.h"
#include "usd/stage/material_binding.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace velatura::translate::geometry {

namespace {

/// The authored polygons, with those marked that can be rendered. Warns about the others, once per
/// kind.
FaceTable read_faces(Context& ctx, Prim prim, const std::vector<Vec3d>& points) {
    FaceTable table;
    // Velocities carry the points of the frame, whatever the topology is at another time
    const bool has_other_time = ctx.time.value() != ctx.frame.value();
    const usd::stage::TimeCode at =
        has_other_time && motion::has_velocities(ctx, prim) ? ctx.frame : ctx.time;
    const auto counts = read_ints(prim.attribute("faceVertexCounts").value(at));
    const auto indices = read_ints(prim.attribute("faceVertexIndices").value(at));
    size_t few = 0, outside = 0, infinite = 0, missing = 0;
    size_t first = 0;
    for (const int64_t count : counts) {
        const size_t n = count > 0 ? size_t(count) : 0;
        bool is_good = count >= 3;
        few += !is_good;
        if (n > indices.size() - first) {
            // The rest of the list has no corners at all
            ++missing;
            table.add(first, 0, false);
            continue;
        }
        for (size_t i = first; i < first + n && is_good; ++i) {
            if (indices[i] < 0 || size_t(indices[i]) >= points.size()) {
                ++outside;
                is_good = false;
            } else if (!is_finite(to_float(points[size_t(indices[i])]))) {
                ++infinite;
                is_good = false;
            }
        }
        table.add(first, n, is_good);
        first += n;
    }
    table.indices.reserve(indices.size());
    for (const int64_t i : indices) table.indices.push_back(uint32_t(i));
    const auto warn_color = [&](size_t count, const char* what) {
        if (count > 0)
            ctx.warn("bad-topology", prim.attribute("faceVertexCounts"),
                     fmt::format("{} of {} faces are skipped: {}", count, counts.size(), what));
    };
    warn_color(few, "fewer than 3 corners");
    warn_color(outside, "vertex index outside the points");
    warn_color(infinite, "point that is not a finite number");
    warn_color(missing, "faceVertexCounts add up to more than faceVertexIndices holds");
    if (first < indices.size())
        ctx.warn("bad-topology", prim.attribute("faceVertexIndices"),
                 fmt::format("{} faceVertexIndices belong to no face and are ignored",
                             indices.size() - first));
    return table;
}

/// Materials by face; also lists every entry that some face uses.
std::vector<scene::MaterialId> read_face_materials(
    Context& ctx,
    Prim prim,
    size_t face_count,
    const materials::MaterialEntry& whole,
    std::vector<const materials::MaterialEntry*>& used) {
    used.push_back(&whole);
    std::vector<scene::MaterialId> materials;
    std::vector<bool> is_taken;
    for (const Prim subset : usd::stage::material_subsets(prim)) {
        if (!materials::has_binding(ctx, subset)) continue;
        const materials::MaterialEntry& entry = materials::bound_material(ctx, subset);
        if (materials.empty()) {
            materials.assign(face_count, whole.id);
            is_taken.assign(face_count, false);
        }
        used.push_back(&entry);
        size_t outside = 0, twice = 0;
        for (const int64_t face : read_ints(subset.attribute("indices").value(ctx.time))) {
            if (face < 0 || size_t(face) >= face_count) {
                ++outside;
            } else if (is_taken[size_t(face)]) {
                ++twice;
            } else {
                is_taken[size_t(face)] = true;
                materials[size_t(face)] = entry.id;
            }
        }
        if (outside + twice > 0)
            ctx.warn("bad-subset", subset.attribute("indices"),
                     fmt::format("{} indices outside the faces of the mesh are ignored; {} belong "
                                 "to an earlier subset and keep its material",
                                 outside, twice));
    }
    // A material that subsets cover everywhere reads nothing
    const auto is_one = [](bool taken) { return taken; };
    if (!is_taken.empty() && std::all_of(is_taken.begin(), is_taken.end(), is_one))
        used.erase(used.begin());
    return materials;
}

/// Keeps the GeomSubsets of faces, in case that lights tell them apart.
void note_face_subsets(Context& ctx,
                       Prim prim,
                       const FaceTable& table,
                       scene::ProvenanceId provenance) {
    std::vector<uint32_t> rendered(table.faces.size(), scene::none);
    uint32_t count = 0;
    for (size_t f = 0; f < table.faces.size(); ++f)
        if (table.faces[f].is_kept) rendered[f] = count++;
    for (const Prim subset : prim.children()) {
        if (subset.type_name().str() != "GeomSubset" ||
            read_text(subset.attribute("elementType"), "face", ctx.time) != "face")
            continue;
        FaceSubset faces{subset.path(), {}};
        for (const int64_t face : read_ints(subset.attribute("indices").value(ctx.time)))
            if (face >= 0 && size_t(face) < rendered.size() &&
                rendered[size_t(face)] != scene::none)
                faces.faces.push_back(rendered[size_t(face)]);
        ctx.state<FaceSubsets>().of_mesh[provenance].push_back(std::move(faces));
    }
}

}  // namespace

std::optional<scene::Shape> read_mesh(Context& ctx,
                                      Prim prim,
                                      const InstanceSource& parent,
                                      const Mat4d& matrix,
                                      const motion::Pose* pose) {
    const std::vector<Vec3d> points = motion::read_points(ctx, prim, pose);
    const bool is_missing =
        (points.empty() && lacks_array(ctx, prim, {"points"}, "empty-mesh")) ||
        lacks_array(ctx, prim, {"faceVertexCounts", "faceVertexIndices"}, "empty-mesh");
    if (is_missing) return std::nullopt;
    FaceTable table = read_faces(ctx, prim, points);
    scene::Mesh mesh;
    mesh.subdivision = read_scheme(ctx, prim);
    if (mesh.subdivision != scene::SubdivisionScheme::None) {
        mesh.rules = read_subdivision_rules(ctx, prim, table, points.size());
    } else {
        for (const size_t face : read_holes(ctx, prim, table.faces.size()))
            table.faces[face].is_kept = false;
    }
    if (table.kept_count() == 0) {
        ctx.warn("empty-mesh", prim, "mesh has no valid face; the prim is skipped");
        return std::nullopt;
    }
    const ElementCounts counts{table.faces.size(), points.size(), table.indices.size()};

    scene::Shape shape;
    const materials::MaterialEntry& whole = materials::bound_material(ctx, prim);
    std::vector<const materials::MaterialEntry*> used;
    mesh.face_materials = read_face_materials(ctx, prim, counts.faces, whole, used);
    shape.material = whole.id;
    mesh.primvars = read_primvars(ctx, prim, counts, used);
    add_object_space(ctx, used, matrix, mesh.primvars);
    const bool is_left_handed =
        read_text(prim.attribute("orientation"), "rightHanded", ctx.time) == "leftHanded";
    if (!set_surface(ctx, prim, table, points, matrix, pose, mesh)) return std::nullopt;
    read_motion(ctx, prim, parent, matrix, pose, table, mesh);
    compact_faces(table, mesh);
    shape.flip_normals = is_left_handed != (determinant3(matrix) < 0.0);
    shape.double_sided = read_bool(prim.attribute("doubleSided"), false, ctx.time);
    shape.provenance = ctx.provenance(prim);
    note_face_subsets(ctx, prim, table, shape.provenance);
    shape.geometry = std::move(mesh);
    return shape;
}

scene::Shape baked(const scene::Shape& shape, const Mat4d& matrix) {
    scene::Shape out = shape;
    if (auto* curves = std::get_if<scene::Curves>(&out.geometry)) {
        curves->shape_from_curves = curves->shape_from_curves * matrix;
        return out;
    }
    if (auto* cloud = std::get_if<scene::Points>(&out.geometry)) {
        cloud->shape_from_points = cloud->shape_from_points * matrix;
        return out;
    }
    if (determinant3(matrix) < 0.0) out.flip_normals = !out.flip_normals;
    if (auto* gprim = std::get_if<scene::Gprim>(&out.geometry)) {
        gprim->shape_from_gprim = gprim->shape_from_gprim * matrix;
        return out;
    }
    auto& mesh = std::get<scene::Mesh>(out.geometry);
    const auto place_points = [&](std::vector<Vec3>& points) {
        for (Vec3& p : points) p = to_float(transform_point(Vec3d(p), matrix));
    };
    const auto place_normals = [&](std::vector<Vec3>& placed) {
        placed = transformed_normals(std::vector<Vec3d>(placed.begin(), placed.end()), matrix);
    };
    place_points(mesh.points);
    place_normals(mesh.normals);
    for (std::vector<Vec3>& key : mesh.later_points) place_points(key);
    for (std::vector<Vec3>& key : mesh.later_normals) place_normals(key);
    return out;
}

}  // namespace velatura::translate::geometry
