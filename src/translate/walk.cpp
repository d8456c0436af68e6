// SPDX-License-Identifier: Apache-2.0
#include "translate/linking.h"
#include "translate/motion.h"
#include "translate/parts.h"
#include "translate/pose.h"
#include "translate/strands.h"
#include "translate/values.h"
#include "translate/volumes.h"
#include "usd/stage/imageable.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::translate {

namespace {

/// The order of siblings in a file says nothing of the picture: sampling and ties go by names, so
/// that it stays the same to the bit when another exporter, or another run of it, writes them in
/// another order.
std::vector<Prim> sorted_by_name(std::vector<Prim> siblings) {
    std::ranges::sort(siblings, {}, [](const Prim& prim) { return prim.name().view(); });
    return siblings;
}

/// Children that a picture shows. Below an `over` or a class (where prototypes of point instancers
/// live) the stage counts nothing as defined: there, what says `def` is shown.
std::vector<Prim> shown_children(Prim prim) {
    if (prim.is_pseudo_root() || (prim.is_defined() && !prim.is_abstract()))
        return sorted_by_name(prim.children());
    std::vector<Prim> out;
    for (const Prim child : prim.all_children()) {
        if (child.is_active() && child.is_loaded() &&
            child.specifier() == usd::layer::Specifier::Def)
            out.push_back(child);
    }
    return sorted_by_name(std::move(out));
}

bool has_no_picture_below(std::string_view type) {
    return type == "Material" || type == "Shader" || type == "NodeGraph" || type == "GeomSubset" ||
           type == "RenderSettings" || type == "RenderProduct" || type == "RenderVar";
}

/// A point of the geometry: the first of a mesh, whose transform alone may leave it far away, else
/// where its transform puts zero.
Vec3d representative_point(Context& ctx, Prim prim, const Mat4d& matrix, const Pose* pose) {
    std::vector<double> rows;
    int width = 0;
    if (prim.is_a("PointBased") &&
        read_rows(prim.attribute("points").value(ctx.time), rows, width) && width == 3 &&
        rows.size() >= 3) {
        const Vec3d first(rows[0], rows[1], rows[2]);
        const Vec3d p =
            pose && pose->skin ? pose->posed_point(first) : transform_point(first, matrix);
        if (is_finite(p)) return p;
    }
    return {matrix[3][0], matrix[3][1], matrix[3][2]};
}

/// Draws the prim itself, without its children.
void draw(Context& ctx, Prim prim, const Mat4d& matrix, Pose* pose, Placeable& out) {
    const std::string_view type = prim.type_name().view();
    if (type.empty() || type == "Xform" || type == "Scope" || type == "Camera") {
        warn_light_without_geometry(ctx, prim);
        return;
    }
    if (!ctx.is_rendered(prim)) return;
    if (!out.is_stage && !out.is_origin_fixed)
        propose_origin(out, representative_point(ctx, prim, matrix, pose));
    const Mat4d placed = relative_to(matrix, out.origin);
    std::optional<scene::Shape> shape;
    ShapeReader read;
    if (type == "Mesh") {
        if (pose) pose->matrix = relative_to(pose->matrix, out.origin);
        shape = read_mesh(ctx, prim, out, placed, pose);
    } else if (type == "BasisCurves" || type == "Points") {
        if (pose) pose->matrix = relative_to(pose->matrix, out.origin);
        warn_round_light(ctx, prim);
        const auto read_round = type == "Points" ? &read_point_cloud : &read_curves;
        read = [&ctx, prim, pose, read_round](const Mat4d& m) {
            return read_round(ctx, prim, m, pose);
        };
    } else if (is_gprim_type(type)) {
        read = [&ctx, prim](const Mat4d& m) { return read_gprim(ctx, prim, m); };
    } else if (type == "Volume") {
        warn_if_it_moves(ctx, prim, out.frame);
        warn_unsupported_features(ctx, prim);
        std::optional<scene::Volume> volume = read_volume(ctx, prim, placed);
        if (!volume) return;
        if (scene::has_emission(*volume, ctx.scene.volume_fields)) ctx.has_light_prim = true;
        out.volumes.push_back(std::move(*volume));
        out.is_origin_fixed = true;
        return;
    } else if (is_light_type(type)) {
        ctx.has_light_prim = true;
        warn_if_it_moves(ctx, prim, out.frame);
        out.lights.push_back({prim, placed});
        note_linking(ctx, prim);
        out.is_origin_fixed = true;
        return;
    } else {
        warn_unsupported(ctx, prim);
        return;
    }
    warn_unsupported_features(ctx, prim);
    if (read) shape = read(placed);
    if (!shape) return;
    const bool has_faces = std::holds_alternative<scene::Mesh>(shape->geometry) ||
                           std::holds_alternative<scene::Gprim>(shape->geometry);
    const bool is_light = has_faces && is_geometry_light(prim);
    if (read && (is_light || (pose && pose->skin))) {
        warn_if_it_moves(ctx, prim, out.frame);
    } else if (read) {
        if (type == "Points" && place_moving_balls(ctx, prim, matrix, *shape, out)) {
            out.is_origin_fixed = true;
            return;
        }
        const Vec3d near = representative_point(ctx, prim, Mat4d(), nullptr);
        if (place_moving_shape(ctx, prim, matrix, near, read, out)) {
            out.is_origin_fixed = true;
            return;
        }
    }
    if (is_light) {
        make_mesh_light(ctx, prim, placed, *shape);
        if (note_linking(ctx, prim) && !out.is_stage)
            ctx.warn("unsupported-light-linking", prim,
                     "all instances of geometry that is a light are linked as the first one");
    }
    out.shapes.push_back(std::move(*shape));
    out.is_origin_fixed = true;
}

void place_instance(Context& ctx, Prim instance, const Mat4d& matrix, Placeable& out) {
    Placeable* prototype = native_prototype(ctx, instance);
    if (prototype == nullptr) {
        ctx.warn("instance-cycle", instance,
                 "instance lies inside its own prototype, it is skipped");
        return;
    }
    Placement placement;
    placement.what = prototype;
    propose_origin(out, transform_point(prototype->origin, matrix));
    placement.matrix = between_origins(matrix, prototype->origin, out.origin);
    placement.provenance = ctx.provenance(instance);
    read_placement_motion(ctx, instance, out, placement);
    out.placements.push_back(std::move(placement));
    out.is_origin_fixed = true;
}

}  // namespace

Mat4d relative_to(const Mat4d& matrix, const Vec3d& origin) {
    Mat4d m = matrix;
    for (int i = 0; i < 3; ++i) m[3][i] -= origin[i];
    return m;
}

Mat4d between_origins(const Mat4d& matrix, const Vec3d& from, const Vec3d& to) {
    Mat4d m = matrix;
    for (int c = 0; c < 3; ++c) {
        // Sum with the rounding errors carried along. Ref: Ogita, Rump, Oishi 2005, "Accurate Sum
        // and Dot Product", SIAM J. Sci. Comput. 26(6), algorithms TwoSum, TwoProduct, Dot2
        double sum = 0.0, error = 0.0;
        const auto add = [&](double v) {
            const double next = sum + v, part = next - sum;
            error += (sum - (next - part)) + (v - part);
            sum = next;
        };
        add(matrix[3][c]);
        add(-to[c]);
        for (int r = 0; r < 3; ++r) {
            const double product = from[r] * matrix[r][c];
            add(product);
            error += std::fma(from[r], matrix[r][c], -product);
        }
        m[3][c] = sum + error;
    }
    return m;
}

void propose_origin(Placeable& out, const Vec3d& position) {
    if (out.is_stage || out.is_origin_fixed || !is_finite(position)) return;
    out.origin = position;
}

void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, Placeable& out) {
    if (!usd::stage::is_visible_itself(prim, ctx.time)) return;
    if (ctx.render_pass && ctx.render_pass->pruned.includes(prim.path())) return;
    const std::string_view type = prim.type_name().view();
    if (has_no_picture_below(type)) return;
    const auto local = usd::stage::local_transform(prim, ctx.time);
    if (local.resets_stack && !out.is_stage)
        ctx.warn("unsupported-reset-stack", prim,
                 "!resetXformStack! inside a prototype is taken relative to the prototype");
    Mat4d matrix = local.resets_stack ? local.matrix : local.matrix * parent_matrix;
    std::optional<Pose> pose = read_pose(ctx, prim, out.frame);
    if (pose && pose->is_rigid) matrix = pose->matrix;
    if (!is_finite(matrix) || !keeps_a_surface(matrix)) {
        ctx.warn("bad-transform", prim,
                 "transform is infinite or flattens everything to a line or a point, the prim and "
                 "what is below are skipped");
        return;
    }
    if (type == "PointInstancer") {
        if (ctx.is_rendered(prim)) read_point_instancer(ctx, prim, matrix, out);
        return;
    }
    const bool is_geometry = prim.is_a("Gprim");
    if (prim.is_instance() && !is_geometry) {
        // The root of an instance is no part of its prototype: a light is one itself
        if (is_light_type(type)) draw(ctx, prim, matrix, pose ? &*pose : nullptr, out);
        place_instance(ctx, prim, matrix, out);
        return;
    }
    draw(ctx, prim, matrix, pose ? &*pose : nullptr, out);
    walk_children(ctx, prim, matrix, out);
}

void walk_children(Context& ctx, Prim prim, const Mat4d& matrix, Placeable& out) {
    for (const Prim child : shown_children(prim)) walk(ctx, child, matrix, out);
}

}  // namespace velatura::translate
