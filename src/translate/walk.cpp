// SPDX-License-Identifier: Apache-2.0
#include "translate/parts.h"
#include "translate/values.h"
#include "usd/stage/imageable.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

namespace velatura::translate {

namespace {

/// Children that a picture shows. Below an `over` or a class (where prototypes of point instancers
/// live) the stage counts nothing as defined: there, what says `def` is shown.
std::vector<Prim> shown_children(Prim prim) {
    if (prim.is_pseudo_root() || (prim.is_defined() && !prim.is_abstract())) return prim.children();
    std::vector<Prim> out;
    for (const Prim child : prim.all_children()) {
        if (child.is_active() && child.is_loaded() &&
            child.specifier() == usd::layer::Specifier::Def)
            out.push_back(child);
    }
    return out;
}

bool has_no_picture_below(std::string_view type) {
    return type == "Material" || type == "Shader" || type == "NodeGraph" || type == "GeomSubset" ||
           type == "RenderSettings" || type == "RenderProduct" || type == "RenderVar";
}

/// Draws the prim itself, without its children.
void draw(Context& ctx, Prim prim, const Mat4d& matrix, Placeable& out) {
    const std::string_view type = prim.type_name().view();
    if (type.empty() || type == "Xform" || type == "Scope" || type == "Camera") return;
    if (!ctx.purposes.contains(usd::stage::computed_purpose(prim))) return;
    const Mat4d placed = relative_to(matrix, out.origin);
    std::optional<scene::Shape> shape;
    if (type == "Mesh") {
        shape = read_mesh(ctx, prim, placed);
    } else if (is_gprim_type(type)) {
        shape = read_gprim(ctx, prim, placed);
    } else if (is_light_type(type)) {
        out.lights.push_back({prim, placed});
        return;
    } else {
        warn_unsupported(ctx, prim);
        return;
    }
    warn_unsupported_features(ctx, prim);
    if (shape) out.shapes.push_back(std::move(*shape));
}

void place_instance(Context& ctx, Prim instance, const Mat4d& matrix, Placeable& out) {
    Placeable* prototype = native_prototype(ctx, instance);
    if (prototype == nullptr) {
        ctx.warn("instance-cycle", instance,
                 "instance lies inside its own prototype, it is left out");
        return;
    }
    Placement placement;
    placement.what = prototype;
    placement.matrix = relative_to(matrix, out.origin);
    placement.provenance = ctx.provenance(instance);
    out.placements.push_back(std::move(placement));
}

}  // namespace

Mat4d relative_to(const Mat4d& matrix, const Vec3d& origin) {
    Mat4d m = matrix;
    for (int i = 0; i < 3; ++i) m[3][i] -= origin[i];
    return m;
}

void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, Placeable& out) {
    if (!usd::stage::is_visible_itself(prim, ctx.time)) return;
    const std::string_view type = prim.type_name().view();
    if (has_no_picture_below(type)) return;
    const auto local = usd::stage::local_transform(prim, ctx.time);
    if (local.resets_stack && !out.is_stage)
        ctx.warn("unsupported-reset-stack", prim,
                 "!resetXformStack! inside a prototype is taken relative to the prototype");
    const Mat4d matrix = local.resets_stack ? local.matrix : local.matrix * parent_matrix;
    if (!is_finite(matrix) || !keeps_a_surface(matrix)) {
        ctx.warn("bad-transform", prim,
                 "transform is infinite or flattens everything to a line or a point, the prim and "
                 "what is below are left out");
        return;
    }
    const bool is_geometry = prim.is_a("Gprim");
    if (prim.is_instance() && !is_geometry) {
        place_instance(ctx, prim, matrix, out);
        return;
    }
    if (type == "PointInstancer") {
        if (ctx.purposes.contains(usd::stage::computed_purpose(prim)))
            read_point_instancer(ctx, prim, matrix, out);
        return;
    }
    draw(ctx, prim, matrix, out);
    for (const Prim child : shown_children(prim)) walk(ctx, child, matrix, out);
}

}  // namespace velatura::translate
