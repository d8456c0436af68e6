// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/strands.h"

#include "translate/context/missing_values.h"
#include "translate/context/values.h"
#include "translate/geometry/primvars.h"
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::translate::geometry {

namespace {

/// The interpolation by which there are as many rows as elements; the authored one if it does.
std::optional<scene::Interpolation> fitting_interpolation(size_t rows,
                                                          scene::Interpolation authored,
                                                          const ElementCounts& counts) {
    using scene::Interpolation;
    if (rows == element_count(counts, authored)) return authored;
    if (rows == 1) return Interpolation::Constant;
    for (const auto other : {Interpolation::Vertex, Interpolation::Varying, Interpolation::Uniform})
        if (rows == element_count(counts, other)) return other;
    return std::nullopt;
}

}  // namespace

bool read_element_rows(Context& ctx,
                       Prim prim,
                       const std::string& name,
                       int width,
                       const ElementCounts& counts,
                       std::string_view fallback,
                       std::optional<ElementRows>& out) {
    const Attribute primvar = prim.attribute("primvars:" + name);
    const Attribute plain = prim.attribute(name);
    std::optional<usd::stage::Primvar> source;
    if (primvar.has_authored_value())
        source = usd::stage::as_primvar(primvar, usd::stage::Interpolation::Constant);
    else if (plain.has_authored_value())
        source = usd::stage::as_primvar(plain, usd::stage::Interpolation::Vertex);
    if (!source) return true;
    const auto reject = [&](const std::string& what) {
        ctx.warn("bad-" + name, source->attribute, fmt::format("{}; {}", what, fallback));
        return false;
    };
    std::vector<double> rows;
    int found_width = 0;
    const usd::layer::Value value = source->attribute.value(ctx.time);
    if (value.is_empty() || value.is_block()) return true;
    if (!read_rows(value, rows, found_width))
        return reject(fmt::format("{} are not numeric", name));
    if (found_width != width)
        return reject(fmt::format("{} have {} components, expected {}", name, found_width, width));
    // Nothing at this time
    if (rows.empty()) return true;
    ElementRows result;
    const std::vector<int> indices =
        source->is_indexed() ? source->index_values(ctx.time) : std::vector<int>();
    const size_t stored = rows.size() / size_t(width);
    for (const int i : indices) {
        if (i < 0 || size_t(i) >= stored)
            return reject(
                fmt::format("{} has the index {}, expected 0 to {}", name, i, stored - 1));
        for (int k = 0; k < width; ++k)
            result.values.push_back(rows[size_t(i) * size_t(width) + size_t(k)]);
    }
    if (indices.empty()) result.values = std::move(rows);
    const size_t found = result.values.size() / size_t(width);
    // usd and scene list their interpolations in one order
    const auto authored = scene::Interpolation(int(source->interpolation));
    const auto fitting = fitting_interpolation(found, authored, counts);
    const std::string counted = fmt::format("{} {} or indices, expected {} ({})", found, name,
                                            element_count(counts, authored),
                                            usd::stage::interpolation_name(source->interpolation));
    if (!fitting) return reject(counted);
    result.interpolation = *fitting;
    if (found != 1 && *fitting != authored)
        ctx.warn(
            "bad-" + name, source->attribute,
            fmt::format("{}; they are taken as {}", counted,
                        usd::stage::interpolation_name(usd::stage::Interpolation(int(*fitting)))));
    // One for everything, whatever it is called
    if (found == 1) result.interpolation = scene::Interpolation::Constant;
    out = std::move(result);
    return true;
}

bool read_widths(Context& ctx,
                 Prim prim,
                 const ElementCounts& counts,
                 std::optional<ElementRows>& out) {
    constexpr std::string_view fallback = "widths fall back to 1";
    if (!read_element_rows(ctx, prim, "widths", 1, counts, fallback, out)) return false;
    if (!out) return true;
    const size_t all = out->values.size();
    size_t bad = 0;
    for (double& width : out->values) {
        if (width >= 0.0 && std::isfinite(float(width))) continue;
        width = 0.0;
        ++bad;
    }
    if (bad == 0) return true;
    const Attribute primvar = prim.attribute("primvars:widths");
    ctx.warn("bad-widths", primvar.has_authored_value() ? primvar : prim.attribute("widths"),
             fmt::format("{} of {} widths are negative or not finite; {}", bad, all,
                         bad == all ? fallback : "these are set to 0"));
    if (bad == all) out.reset();
    return bad < all;
}

bool keeps_spheres(const Mat4d& matrix) {
    constexpr double largest_distortion = 0x1p20 / 27;
    const Mat3d cofactors = cofactor_matrix(matrix);
    const double det = std::abs(determinant3(matrix));
    double forward = 0, backward = 0;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            forward = std::max(forward, std::abs(matrix[i][k]));
            backward = std::max(backward, std::abs(cofactors[i][k]) / det);
        }
    }
    return det > 0.0 && forward * backward < largest_distortion;
}

std::optional<RoundPlacement> place_round(Context& ctx,
                                          Prim prim,
                                          const Mat4d& matrix,
                                          const Vec3d& first) {
    // Widths of less than float accuracy are not worth an ellipse
    constexpr double evenness = 0x1p-20;
    if (!keeps_spheres(matrix)) {
        ctx.warn("bad-transform", prim, "transform flattens widths, the prim is skipped");
        return std::nullopt;
    }
    RoundPlacement placement;
    const double scale2 = std::cbrt(determinant3(matrix) * determinant3(matrix));
    bool is_even = true;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            double product = 0;
            for (int j = 0; j < 3; ++j) product += matrix[i][j] * matrix[k][j];
            is_even = is_even && std::abs(product - (i == k ? scale2 : 0.0)) <= evenness * scale2;
        }
    }
    if (is_even) {
        placement.parent_from_points = matrix;
        placement.width_scale = std::sqrt(scale2);
        return placement;
    }
    // Around the first point, so that little is lost by the cast to float
    Mat4d away;
    away.setTranslation(first);
    placement.shape_from_stored = away * matrix;
    placement.parent_from_points.setTranslation(-first);
    return placement;
}

scene::Shape round_shape(Context& ctx, Prim prim, const materials::MaterialEntry& material) {
    scene::Shape shape;
    shape.material = material.id;
    shape.flip_normals =
        read_text(prim.attribute("orientation"), "rightHanded", ctx.time) == "leftHanded";
    shape.double_sided = read_bool(prim.attribute("doubleSided"), false, ctx.time);
    shape.provenance = ctx.provenance(prim);
    if (material.is_emissive)
        ctx.warn("unsupported-light", prim,
                 fmt::format("{} are emissive, but not sampled as lights: expect noise",
                             prim.type_name().str()));
    if (read_bool(prim.attribute("primvars:screenSpaceWidths"), false, ctx.time))
        ctx.warn("unsupported-widths", prim,
                 "screen-space widths are not supported; they are read as scene units");
    return shape;
}

std::optional<scene::Shape> read_point_cloud(Context& ctx,
                                             Prim prim,
                                             const Mat4d& matrix,
                                             const motion::Pose* pose) {
    const std::vector<Vec3d> points = motion::read_points(ctx, prim, pose);
    if (points.empty()) {
        lacks_array(ctx, prim, {"points"}, "empty-points");
        return std::nullopt;
    }
    const ElementCounts counts{1, points.size(), 0};
    std::optional<ElementRows> widths;
    read_widths(ctx, prim, counts, widths);
    const Mat4d& from = pose && pose->skin ? pose->matrix : matrix;
    const auto placement = place_round(ctx, prim, from, points[0]);
    if (!placement) return std::nullopt;

    scene::Points cloud;
    const materials::MaterialEntry& material = materials::bound_material(ctx, prim);
    materials::warn_if_displaced(ctx, prim, material);
    cloud.primvars = read_primvars(ctx, prim, counts, {&material});
    add_object_space(ctx, {&material}, matrix, cloud.primvars);
    cloud.shape_from_points = placement->shape_from_stored;
    size_t bad = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        double width = 1.0;
        if (widths) width = widths->values[widths->values.size() == 1 ? 0 : i];
        Vec3 p = to_float(transform_point(points[i], placement->parent_from_points));
        auto stored = float(width * placement->width_scale);
        if (!is_finite(p) || !(stored >= 0.0f) || !std::isfinite(stored)) {
            // Its place among the primvars is kept
            p = Vec3(0.0f);
            stored = 0.0f;
            ++bad;
        }
        cloud.points.push_back(p);
        cloud.widths.push_back(stored);
    }
    if (bad > 0)
        ctx.warn("bad-points", prim,
                 fmt::format("{} of {} points are not finite and are skipped{}", bad, points.size(),
                             bad == points.size() ? ": the prim is skipped" : ""));
    if (bad == points.size()) return std::nullopt;
    scene::Shape shape = round_shape(ctx, prim, material);
    shape.geometry = std::move(cloud);
    return shape;
}

}  // namespace velatura::translate::geometry
