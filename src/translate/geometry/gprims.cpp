// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/gprims.h"

#include "translate/context/values.h"
#include "translate/geometry/primvars.h"
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <cmath>

namespace velatura::translate::geometry {

namespace {

using Kind = scene::Gprim::Kind;

std::optional<Kind> gprim_kind(std::string_view type) {
    if (type == "Sphere") return Kind::Sphere;
    if (type == "Cube") return Kind::Cube;
    if (type == "Cylinder" || type == "Cylinder_1") return Kind::Cylinder;
    if (type == "Cone") return Kind::Cone;
    if (type == "Capsule" || type == "Capsule_1") return Kind::Capsule;
    if (type == "Plane") return Kind::Plane;
    return std::nullopt;
}

/// Turns the gprim's own axis Z into the authored one; a proper rotation. A Plane's width and
/// length go where UsdGeomPlane puts them: x and y for Z, z and y for X, x and z for Y.
Mat4d axis_matrix(std::string_view axis) {
    if (axis == "X") return Mat4d(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1);
    if (axis == "Y") return Mat4d(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);
    return Mat4d();
}

/// Radius of the newer cylinders and capsules, which may differ at their ends.
double end_radius(Context& ctx, Prim prim, double fallback) {
    const double bottom = read_number(prim.attribute("radiusBottom"), fallback, ctx.time);
    const double top = read_number(prim.attribute("radiusTop"), fallback, ctx.time);
    if (bottom != top)
        ctx.warn(
            "unsupported-radius", prim.attribute("radiusTop"),
            fmt::format("radiusTop {} is not supported, radiusBottom {} is used", top, bottom));
    return bottom;
}

bool read_sizes(Context& ctx, Prim prim, scene::Gprim& gprim) {
    const auto number = [&](const char* name, double fallback) {
        return read_number(prim.attribute(name), fallback, ctx.time);
    };
    const bool has_two_radii = prim.type_name() == "Cylinder_1" || prim.type_name() == "Capsule_1";
    const bool is_capsule = gprim.kind == Kind::Capsule;
    const double radius = is_capsule ? 0.5 : 1.0;
    gprim.radius = has_two_radii ? end_radius(ctx, prim, radius) : number("radius", radius);
    gprim.height = number("height", is_capsule ? 1.0 : 2.0);
    gprim.size = number("size", 2.0);
    gprim.width = number("width", 2.0);
    gprim.length = number("length", 2.0);
    const auto positive = [](double v) { return v > 0.0 && std::isfinite(v); };
    switch (gprim.kind) {
        case Kind::Sphere:
            return positive(gprim.radius);
        case Kind::Cube:
            return positive(gprim.size);
        case Kind::Plane:
            return positive(gprim.width) && positive(gprim.length);
        case Kind::Cylinder:
        case Kind::Cone:
            return positive(gprim.radius) && positive(gprim.height);
        // A capsule without a side is a sphere
        case Kind::Capsule:
            return positive(gprim.radius) && gprim.height >= 0.0 && std::isfinite(gprim.height);
    }
    return false;
}

}  // namespace

bool is_gprim_type(std::string_view type) {
    return gprim_kind(type).has_value();
}

std::optional<scene::Shape> read_gprim(Context& ctx, Prim prim, const Mat4d& matrix) {
    const auto kind = gprim_kind(prim.type_name().view());
    if (!kind) return std::nullopt;
    scene::Gprim gprim;
    gprim.kind = *kind;
    if (!read_sizes(ctx, prim, gprim)) {
        ctx.warn("bad-gprim-size", prim, "sizes are not positive numbers, the prim is skipped");
        return std::nullopt;
    }
    const std::string axis = read_text(prim.attribute("axis"), "Z", ctx.time);
    const bool has_axis = *kind != Kind::Sphere && *kind != Kind::Cube;
    gprim.shape_from_gprim = has_axis ? axis_matrix(axis) * matrix : matrix;
    scene::Shape shape;
    const materials::MaterialEntry& material = materials::bound_material(ctx, prim);
    shape.material = material.id;
    materials::warn_if_displaced(ctx, prim, material);
    const ElementCounts counts{1, 1, 1};
    for (scene::Primvar& primvar : read_primvars(ctx, prim, counts, {&material})) {
        // One value means the same in every interpolation
        primvar.interpolation = scene::Interpolation::Constant;
        gprim.primvars.push_back(std::move(primvar));
    }
    add_object_space(ctx, {&material}, matrix, gprim.primvars);
    const bool is_left_handed =
        read_text(prim.attribute("orientation"), "rightHanded", ctx.time) == "leftHanded";
    shape.flip_normals = is_left_handed != (determinant3(matrix) < 0.0);
    shape.double_sided = read_bool(prim.attribute("doubleSided"), *kind == Kind::Plane, ctx.time);
    shape.provenance = ctx.provenance(prim);
    shape.geometry = std::move(gprim);
    return shape;
}

}  // namespace velatura::translate::geometry
