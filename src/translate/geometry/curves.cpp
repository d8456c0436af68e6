// SPDX-License-Identifier: Apache-2.0
#include "scene/curves.h"

#include "translate/context/missing_values.h"
#include "translate/context/values.h"
#include "translate/geometry/mesh_surface.h"
#include "translate/geometry/primvars.h"
#include "translate/geometry/strands.h"
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace velatura::translate::geometry {

namespace {

using Basis = scene::Curves::Basis;
using Wrap = scene::Curves::Wrap;
using scene::Interpolation;

/// The authored curves, and which of them are rendered.
struct CurveTable {
    struct Curve {
        size_t vertex = 0, vertices = 0;  ///< the first, and how many
        size_t varying = 0, varyings = 0;
        const char* fault = nullptr;  ///< why it is left out
    };

    std::vector<Curve> curves;

    size_t varying_count() const {
        return curves.empty() ? 0 : curves.back().varying + curves.back().varyings;
    }

    /// The elements of those that stay.
    std::vector<uint32_t> kept(Interpolation interpolation) const {
        std::vector<uint32_t> elements;
        for (size_t i = 0; i < curves.size(); ++i) {
            const Curve& c = curves[i];
            if (c.fault) continue;
            size_t first = i, count = 1;
            if (interpolation == Interpolation::Vertex) {
                first = c.vertex;
                count = c.vertices;
            } else if (interpolation == Interpolation::Varying) {
                first = c.varying;
                count = c.varyings;
            }
            for (size_t k = 0; k < count; ++k) elements.push_back(uint32_t(first + k));
        }
        return elements;
    }
};

/// The value of a token; the first of `names`, the schema's fallback, with a warning for unknown
/// ones.
template <class Value>
Value read_token(Context& ctx,
                 Prim prim,
                 const char* name,
                 const std::vector<std::pair<std::string_view, Value>>& names) {
    const Attribute attribute = prim.attribute(name);
    const std::string token = read_text(attribute, names[0].first, ctx.time);
    for (const auto& [known, value] : names)
        if (token == known) return value;
    ctx.warn("unsupported-curves", attribute,
             fmt::format("{} \"{}\" of curves is unknown; it falls back to {}", name, token,
                         names[0].first));
    return names[0].second;
}

bool read_kind(Context& ctx, Prim prim, scene::Curves& curves) {
    const bool is_linear =
        read_token<bool>(ctx, prim, "type", {{"cubic", false}, {"linear", true}});
    const std::string basis = read_text(prim.attribute("basis"), "bezier", ctx.time);
    // Points of other kinds: nothing that is known stands for them
    if (!is_linear && (basis == "hermite" || basis == "power")) {
        ctx.warn("unsupported-curves", prim.attribute("basis"),
                 fmt::format("curves of basis {} are not supported, the prim is skipped", basis));
        return false;
    }
    curves.wrap = read_token<Wrap>(ctx, prim, "wrap",
                                   {{"nonperiodic", Wrap::Nonperiodic},
                                    {"periodic", Wrap::Periodic},
                                    {"pinned", Wrap::Pinned}});
    curves.basis = is_linear ? Basis::Linear
                             : read_token<Basis>(ctx, prim, "basis",
                                                 {{"bezier", Basis::Bezier},
                                                  {"bspline", Basis::Bspline},
                                                  {"catmullRom", Basis::CatmullRom}});
    return true;
}

CurveTable read_table(Context& ctx,
                      Prim prim,
                      const scene::Curves& kind,
                      const std::vector<Vec3d>& points) {
    CurveTable table;
    const Attribute attribute = prim.attribute("curveVertexCounts");
    size_t vertex = 0, varying = 0;
    for (const int64_t count : read_ints(attribute.value(ctx.time))) {
        CurveTable::Curve curve{vertex, count > 0 ? size_t(count) : 0, varying, 0, nullptr};
        if (curve.vertices > points.size() - vertex) {
            curve.vertices = 0;
            curve.fault = "curveVertexCounts add up to more than there are points";
        } else if (scene::segment_count(kind.basis, kind.wrap, curve.vertices) == 0) {
            curve.fault = "vertex count does not fit basis and wrap";
        }
        curve.varyings = scene::varying_count(kind.basis, kind.wrap, curve.vertices);
        vertex += curve.vertices;
        varying += curve.varyings;
        table.curves.push_back(curve);
    }
    if (vertex < points.size() && !table.curves.empty())
        ctx.warn(
            "bad-topology", attribute,
            fmt::format("{} points belong to no curve and are ignored", points.size() - vertex));
    return table;
}

/// Marks curves whose points make no curve.
void find_faults(const std::vector<Vec3>& points, CurveTable& table) {
    for (CurveTable::Curve& c : table.curves) {
        if (c.fault) continue;
        const auto begin = points.begin() + std::ptrdiff_t(c.vertex);
        const auto end = begin + std::ptrdiff_t(c.vertices);
        if (!std::all_of(begin, end, [](const Vec3& p) { return velatura::is_finite(p); })) {
            c.fault = "a point that is not a finite number";
            continue;
        }
        if (std::all_of(begin, end, [&](const Vec3& p) { return p == *begin; })) {
            c.fault = "no length";
        }
    }
}

/// One warning for every kind of fault.
void report_faults(Context& ctx, Prim prim, const CurveTable& table) {
    std::map<std::string, size_t> faults;
    for (const CurveTable::Curve& curve : table.curves)
        if (curve.fault) ++faults[curve.fault];
    for (const auto& [fault, count] : faults)
        ctx.warn("bad-curves", prim.attribute("curveVertexCounts"),
                 fmt::format("{} of {} curves are skipped: {}", count, table.curves.size(), fault));
}

/// Drops the elements of curves that are left out.
void compact(const CurveTable& table, scene::Primvar& primvar) {
    if (primvar.interpolation == Interpolation::Constant) return;
    std::vector<uint32_t> kept = table.kept(primvar.interpolation);
    if (!primvar.indices.empty()) {
        for (uint32_t& element : kept) element = primvar.indices[element];
        primvar.indices = std::move(kept);
        return;
    }
    const size_t width = primvar.width;
    std::vector<float> values;
    values.reserve(kept.size() * width);
    for (const uint32_t element : kept)
        for (size_t k = 0; k < width; ++k) values.push_back(primvar.values[element * width + k]);
    primvar.values = std::move(values);
}

/// Rows of the curves that stay.
std::vector<double> kept_rows(const CurveTable& table, const ElementRows& rows, size_t width) {
    if (rows.interpolation == Interpolation::Constant) return rows.values;
    std::vector<double> kept;
    for (const uint32_t element : table.kept(rows.interpolation))
        for (size_t k = 0; k < width; ++k) kept.push_back(rows.values[element * width + k]);
    return kept;
}

}  // namespace

std::optional<scene::Shape> read_curves(Context& ctx,
                                        Prim prim,
                                        const Mat4d& matrix,
                                        const motion::Pose* pose) {
    scene::Curves curves;
    if (!read_kind(ctx, prim, curves)) return std::nullopt;
    const std::vector<Vec3d> points = motion::read_points(ctx, prim, pose);
    CurveTable table = read_table(ctx, prim, curves, points);
    if (points.empty() || table.curves.empty()) {
        lacks_array(ctx, prim, {"points", "curveVertexCounts"}, "empty-curves");
        return std::nullopt;
    }
    const ElementCounts counts{table.curves.size(), points.size(), 0, table.varying_count()};
    const Mat4d& from = pose && pose->skin ? pose->matrix : matrix;
    const auto placement = place_round(ctx, prim, from, points[0]);
    std::optional<ElementRows> widths, normals;
    if (!placement) return std::nullopt;
    if (read_widths(ctx, prim, counts, widths) && !widths)
        ctx.warn("missing-widths", prim, "curves without widths are taken to be 1 wide");
    if (!widths) widths = ElementRows{{1.0}, Interpolation::Constant};
    read_element_rows(ctx, prim, "normals", 3, counts, "normals are ignored, the curves are round",
                      normals);
    if (normals && !std::all_of(normals->values.begin(), normals->values.end(),
                                [](double v) { return std::isfinite(v); })) {
        ctx.warn("bad-normals", prim.attribute("normals"),
                 "some normals are not finite; normals are ignored, and the curves are round");
        normals.reset();
    }

    for (const Vec3d& p : points)
        curves.points.push_back(to_float(transform_point(p, placement->parent_from_points)));
    find_faults(curves.points, table);
    report_faults(ctx, prim, table);
    const materials::MaterialEntry& material = materials::bound_material(ctx, prim);
    materials::warn_if_displaced(ctx, prim, material);
    curves.primvars = read_primvars(ctx, prim, counts, {&material});
    add_object_space(ctx, {&material}, matrix, curves.primvars);
    for (scene::Primvar& primvar : curves.primvars) compact(table, primvar);
    std::vector<Vec3> kept_points;
    for (const uint32_t vertex : table.kept(Interpolation::Vertex))
        kept_points.push_back(curves.points[vertex]);
    curves.points = std::move(kept_points);
    for (const CurveTable::Curve& curve : table.curves)
        if (!curve.fault) curves.vertex_counts.push_back(uint32_t(curve.vertices));
    if (curves.vertex_counts.empty()) return std::nullopt;
    for (const double width : kept_rows(table, *widths, 1))
        curves.widths.push_back(float(width * placement->width_scale));
    curves.width_interpolation = widths->interpolation;
    if (normals) {
        const std::vector<double> rows = kept_rows(table, *normals, 3);
        std::vector<Vec3d> directions;
        for (size_t i = 0; i + 2 < rows.size(); i += 3)
            directions.emplace_back(rows[i], rows[i + 1], rows[i + 2]);
        curves.normals = transformed_normals(directions, placement->parent_from_points);
        curves.normal_interpolation = normals->interpolation;
    }
    curves.shape_from_curves = placement->shape_from_stored;
    scene::Shape shape = round_shape(ctx, prim, material);
    shape.geometry = std::move(curves);
    return shape;
}

}  // namespace velatura::translate::geometry
