// SPDX-License-Identifier: Apache-2.0
#include "translate/walk.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/gprims.h"
#include "translate/geometry/mesh.h"
#include "translate/geometry/strands.h"
#include "translate/instancing/instancing.h"
#include "translate/instancing/moving_shape.h"
#include "translate/instancing/moving_spheres.h"
#include "translate/instancing/placement_motion.h"
#include "translate/lights/lights.h"
#include "translate/lights/mesh_lights.h"
#include "translate/linking/linking.h"
#include "translate/linking/ray_visibility.h"
#include "translate/motion/pose.h"
#include "translate/motion/unblurred.h"
#include "translate/unsupported.h"
#include "translate/volumes/volumes.h"
#include "usd/stage/imageable.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::translate {

namespace {

/// The order of siblings in a file says nothing of the image: sampling and ties go by names, so
/// that it stays the same to the bit when another exporter, or another run of it, writes them in
/// another order.
std::vector<Prim> sorted_by_name(std::vector<Prim> siblings) {
    std::ranges::sort(siblings, {}, [](const Prim& prim) { return prim.name().view(); });
    return siblings;
}

/// Children that an image shows. Below an `over` or a class (where prototypes of point instancers
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

bool has_no_image_below(std::string_view type) {
    return type == "Material" || type == "Shader" || type == "NodeGraph" || type == "GeomSubset" ||
           type == "RenderSettings" || type == "RenderProduct" || type == "RenderVar";
}

/// A point of the geometry: the first of a mesh, whose transform alone may leave it far away, else
/// where its transform puts zero.
Vec3d representative_point(Context& ctx, Prim prim, const Mat4d& matrix, const motion::Pose* pose) {
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

void note_mesh_light_links(Context& ctx, Prim prim, const InstanceSource& out) {
    if (linking::note_linking(ctx, prim) && !out.is_stage)
        ctx.warn(
            "unsupported-light-linking", prim,
            "light links of instanced emissive geometry: all instances use those of the first");
}

/// Draws the prim itself, without its children.
void draw(Context& ctx, Prim prim, const Mat4d& matrix, motion::Pose* pose, InstanceSource& out) {
    const std::string_view type = prim.type_name().view();
    if (type.empty() || type == "Xform" || type == "Scope" || type == "Camera") {
        warn_light_without_geometry(ctx, prim);
        return;
    }
    if (!ctx.rendered.includes(prim)) return;
    if (!out.is_stage && !out.is_origin_fixed)
        propose_origin(out, representative_point(ctx, prim, matrix, pose));
    const Mat4d placed = relative_to(matrix, out.origin);
    std::optional<scene::Shape> shape;
    instancing::ShapeReader read;
    if (type == "Mesh") {
        if (pose) pose->matrix = relative_to(pose->matrix, out.origin);
        shape = geometry::read_mesh(ctx, prim, out, placed, pose);
    } else if (type == "BasisCurves" || type == "Points") {
        if (pose) pose->matrix = relative_to(pose->matrix, out.origin);
        warn_round_light(ctx, prim);
        const auto read_round =
            type == "Points" ? &geometry::read_point_cloud : &geometry::read_curves;
        read = [&ctx, prim, pose, read_round](const Mat4d& m) {
            return read_round(ctx, prim, m, pose);
        };
    } else if (geometry::is_gprim_type(type)) {
        read = [&ctx, prim](const Mat4d& m) { return geometry::read_gprim(ctx, prim, m); };
    } else if (type == "Volume") {
        warn_unsupported_features(ctx, prim);
        std::optional<scene::Volume> volume = volumes::read_volume(ctx, prim, placed);
        if (!volume) return;
        instancing::read_volume_motion(ctx, prim, out, *volume);
        if (scene::has_emission(*volume, ctx.scene.volume_fields))
            ctx.state<lights::CollectedLights>().has_prim = true;
        out.volumes.push_back(std::move(*volume));
        out.is_origin_fixed = true;
        return;
    } else if (lights::is_light_type(type)) {
        ctx.state<lights::CollectedLights>().has_prim = true;
        LightSite site{prim, placed};
        instancing::read_light_motion(ctx, out, site);
        out.lights.push_back(std::move(site));
        linking::note_linking(ctx, prim);
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
    const bool is_light = has_faces && lights::is_geometry_light(prim);
    if (read && pose && pose->skin) {
        motion::warn_if_it_moves(ctx, prim, out.frame);
    } else if (read) {
        if (type == "Points" && instancing::place_moving_spheres(ctx, prim, matrix, *shape, out)) {
            out.is_origin_fixed = true;
            return;
        }
        const Vec3d near = representative_point(ctx, prim, Mat4d(), nullptr);
        const bool moves =
            instancing::place_moving_shape(ctx, prim, matrix, near, {read, is_light}, out);
        if (moves) {
            if (is_light) note_mesh_light_links(ctx, prim, out);
            out.is_origin_fixed = true;
            return;
        }
    }
    if (is_light) {
        LightSite site{prim, placed};
        const auto* mesh = std::get_if<scene::Mesh>(&shape->geometry);
        if (mesh && !mesh->later_points.empty()) instancing::read_light_motion(ctx, out, site);
        lights::make_mesh_light(ctx, site, *shape);
        note_mesh_light_links(ctx, prim, out);
    }
    out.shapes.push_back(std::move(*shape));
    out.is_origin_fixed = true;
}

void place_instance(Context& ctx, Prim instance, const Mat4d& matrix, InstanceSource& out) {
    InstanceSource* prototype = instancing::native_prototype(ctx, instance, walk_children);
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
    instancing::read_placement_motion(ctx, instance, out, placement);
    out.placements.push_back(std::move(placement));
    out.is_origin_fixed = true;
}

}  // namespace

void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, InstanceSource& out) {
    if (!usd::stage::is_visible_itself(prim, ctx.time)) return;
    if (ctx.rendered.pass && ctx.rendered.pass->pruned.includes(prim.path())) return;
    const std::string_view type = prim.type_name().view();
    if (has_no_image_below(type)) return;
    const auto local = usd::stage::local_transform(prim, ctx.time);
    if (local.resets_stack && !out.is_stage)
        ctx.warn("unsupported-reset-stack", prim,
                 "!resetXformStack! inside a prototype is taken relative to the prototype");
    Mat4d matrix = local.resets_stack ? local.matrix : local.matrix * parent_matrix;
    std::optional<motion::Pose> pose = motion::read_pose(ctx, prim, out.frame);
    if (pose && pose->is_rigid) matrix = pose->matrix;
    if (!is_finite(matrix) || !keeps_a_surface(matrix)) {
        ctx.warn("bad-transform", prim,
                 "transform is infinite or flattens everything to a line or a point; the prim and "
                 "its children are skipped");
        return;
    }
    const bool is_seen = linking::note_visibility(ctx, prim);
    if (type == "PointInstancer") {
        if (ctx.rendered.includes(prim))
            instancing::read_point_instancer(ctx, prim, matrix, out, walk);
        return;
    }
    const bool is_geometry = prim.is_a("Gprim");
    if (prim.is_instance() && !is_geometry) {
        // The root of an instance is no part of its prototype: a light is one itself
        if (lights::is_light_type(type)) draw(ctx, prim, matrix, pose ? &*pose : nullptr, out);
        place_instance(ctx, prim, matrix, out);
        return;
    }
    if (is_seen || lights::is_light_type(type))
        draw(ctx, prim, matrix, pose ? &*pose : nullptr, out);
    walk_children(ctx, prim, matrix, out);
}

void walk_children(Context& ctx, Prim prim, const Mat4d& matrix, InstanceSource& out) {
    for (const Prim child : shown_children(prim)) walk(ctx, child, matrix, out);
}

}  // namespace velatura::translate
