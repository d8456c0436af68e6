// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/primvars.h"

#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/geometry/gprims.h"
#include "translate/lights/mesh_lights.h"
#include "translate/materials/materials.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>

namespace velatura::translate::geometry {

namespace {

scene::Interpolation interpolation_of(usd::stage::Interpolation interpolation) {
    switch (interpolation) {
        case usd::stage::Interpolation::Constant:
            return scene::Interpolation::Constant;
        case usd::stage::Interpolation::Uniform:
            return scene::Interpolation::Uniform;
        case usd::stage::Interpolation::Varying:
            return scene::Interpolation::Varying;
        case usd::stage::Interpolation::Vertex:
            return scene::Interpolation::Vertex;
        case usd::stage::Interpolation::FaceVarying:
            return scene::Interpolation::FaceVarying;
    }
    return scene::Interpolation::Constant;
}

bool is_wanted(const Context& ctx,
               const std::string& name,
               const std::vector<const materials::MaterialEntry*>& materials) {
    if (ctx.state<RequestedPrimvars>().names.contains(name)) return true;
    const auto& names = scene::texture_coordinate_names;
    const bool can_be_tangents = std::find(names.begin(), names.end(), name) != names.end();
    return std::any_of(materials.begin(), materials.end(), [&](const materials::MaterialEntry* m) {
        return (m->needs_tangents && can_be_tangents) ||
               std::find(m->primvars.begin(), m->primvars.end(), name) != m->primvars.end();
    });
}

/// Whether directions around its axis and along it come with the shape: curves, points and quadrics
/// that stay quadrics (geometry::GeometrySet), which lights do not.
bool has_own_tangents(Prim prim, const materials::MaterialEntry& material) {
    const std::string_view type = prim.type_name().view();
    if (type == "BasisCurves" || type == "Points") return true;
    const bool is_quadric = is_gprim_type(type) && type != "Cube" && type != "Plane";
    return is_quadric && !material.is_emissive && !lights::is_geometry_light(prim);
}

/// Warns about materials that stretch their highlights along a direction that nothing tells.
void warn_tangents(Context& ctx,
                   Prim prim,
                   const std::vector<const materials::MaterialEntry*>& materials,
                   const std::vector<scene::Primvar>& primvars) {
    const auto needs =
        std::find_if(materials.begin(), materials.end(), [&](const materials::MaterialEntry* m) {
            return m->needs_tangents && !has_own_tangents(prim, *m);
        });
    const bool has_coordinates = std::any_of(primvars.begin(), primvars.end(), [](const auto& p) {
        // One pair for the whole prim has no direction
        return p.width == 2 && p.values.size() > 2;
    });
    if (needs == materials.end() || has_coordinates) return;
    ctx.warn("missing-tangents", prim,
             fmt::format("<{}> has no texture coordinates to orient the anisotropy of material "
                         "<{}>; a direction derived from the normal is used",
                         prim.path_string(), (*needs)->name));
}

/// Takes the indices over, checked; false when they do not fit.
bool take_indices(Context& ctx,
                  const usd::stage::Primvar& source,
                  size_t rows,
                  size_t expected,
                  scene::Primvar& out) {
    const std::vector<int> indices = source.index_values(ctx.time);
    if (indices.empty() && expected > 0 && !source.is_indexed()) return true;
    if (out.interpolation != scene::Interpolation::Constant && indices.size() != expected) {
        ctx.warn("bad-primvar", source.indices,
                 fmt::format("primvar {} has {} indices, expected {}; it is ignored, its fallback "
                             "is used",
                             source.name, indices.size(), expected));
        return false;
    }
    out.indices.reserve(indices.size());
    for (const int i : indices) {
        if (i < 0 || size_t(i) >= rows) {
            ctx.warn(
                "bad-primvar", source.indices,
                fmt::format("primvar {} has the index {}, expected 0 to {}; it is ignored, its "
                            "fallback is used",
                            source.name, i, int64_t(rows) - 1));
            return false;
        }
        out.indices.push_back(uint32_t(i));
    }
    return true;
}

std::optional<scene::Primvar> read_primvar(Context& ctx,
                                           const usd::stage::Primvar& source,
                                           const ElementCounts& counts) {
    scene::Primvar out;
    int width = 0;
    if (!color::read_color_rows(ctx, source.attribute, out.values, width)) {
        ctx.warn("unsupported-primvar", source.attribute,
                 fmt::format("primvar {} of type {} is not supported; it is ignored, its fallback "
                             "is used",
                             source.name, source.attribute.type_name().str()));
        return std::nullopt;
    }
    if (source.element_size != 1) {
        ctx.warn("unsupported-primvar", source.attribute,
                 fmt::format("primvar {} has elementSize {}, only 1 is supported; it is ignored, "
                             "its fallback is used",
                             source.name, source.element_size));
        return std::nullopt;
    }
    out.width = uint8_t(width);
    out.interpolation = interpolation_of(source.interpolation);
    const size_t rows = out.values.size() / size_t(width);
    const size_t expected = element_count(counts, out.interpolation);
    if (rows == 0) return std::nullopt;
    const bool is_constant = out.interpolation == scene::Interpolation::Constant;
    if (!source.is_indexed() && !is_constant && rows != expected) {
        // One value for everything is what many exporters mean by it
        ctx.warn(
            "bad-primvar", source.attribute,
            fmt::format(
                "primvar {} has {} values, expected {}; {}", source.name, rows, expected,
                rows == 1 ? "it is taken as constant" : "it is ignored, its fallback is used"));
        if (rows != 1) return std::nullopt;
        out.interpolation = scene::Interpolation::Constant;
    }
    if (is_constant && !source.is_indexed() && rows > 1)
        ctx.warn("bad-primvar", source.attribute,
                 fmt::format("primvar {} is constant and has {} values, expected 1; the first is "
                             "used everywhere",
                             source.name, rows));
    if (source.is_indexed() && !take_indices(ctx, source, rows, expected, out)) return std::nullopt;
    out.name = scene::intern_primvar(ctx.scene, source.name);
    out.yields_to_instance = ctx.is_outside_prototype(source.attribute.prim());
    return out;
}

/// Whether the primvar holds nothing, which is no fault of its own.
bool is_empty(Context& ctx, const usd::stage::Primvar& source) {
    std::vector<float> rows;
    int width = 0;
    return read_rows(source.attribute.value(ctx.time), rows, width) && rows.empty();
}

/// One warning for everything that the materials read here in vain. `told` are the primvars that
/// are there, or whose own fault is reported.
void warn_missing(Context& ctx,
                  Prim prim,
                  const std::vector<const materials::MaterialEntry*>& materials,
                  const std::unordered_set<std::string>& told) {
    std::set<std::pair<std::string, std::string>> missing;
    for (const materials::MaterialEntry* material : materials) {
        for (const std::string& name : material->needed) {
            const bool is_of_instances = std::any_of(
                ctx.point_prototypes.begin(), ctx.point_prototypes.end(),
                [&](const PrototypeScope& open) { return open.inherited.contains(name); });
            if (!told.contains(name) && !is_of_instances) missing.emplace(material->name, name);
        }
    }
    if (missing.empty()) return;
    std::string text;
    for (const auto& [material, name] : missing)
        text += fmt::format("{}primvar {} that material <{}> reads", text.empty() ? "" : ", ", name,
                            material);
    ctx.warn("missing-primvar", prim,
             fmt::format("<{}> has no {}; zero is read", prim.path_string(), text));
}

}  // namespace

void RequestedPrimvars::note(const usd::stage::Primvar& primvar, int width) {
    if (!lists_all) return;
    scene::FoundPrimvar& known = found[primvar.name];
    known.name = primvar.name;
    if (width < known.width || (width == known.width && !known.type.empty())) return;
    known.width = width;
    known.type = primvar.attribute.type_name().str();
}

size_t element_count(const ElementCounts& counts, scene::Interpolation interpolation) {
    switch (interpolation) {
        case scene::Interpolation::Constant:
            return 1;
        case scene::Interpolation::Uniform:
            return counts.faces;
        case scene::Interpolation::Varying:
            return counts.varying.value_or(counts.points);
        case scene::Interpolation::Vertex:
            return counts.points;
        case scene::Interpolation::FaceVarying:
            return counts.corners;
    }
    return 0;
}

std::vector<scene::Primvar> read_primvars(
    Context& ctx,
    Prim prim,
    const ElementCounts& counts,
    const std::vector<const materials::MaterialEntry*>& materials) {
    std::vector<scene::Primvar> out;
    std::unordered_set<std::string> told;
    for (const usd::stage::Primvar& source : usd::stage::find_primvars(prim)) {
        RequestedPrimvars& requested = ctx.state<RequestedPrimvars>();
        if (!is_wanted(ctx, source.name, materials)) {
            requested.note(source, 0);
            continue;
        }
        if (auto primvar = read_primvar(ctx, source, counts)) {
            requested.note(source, primvar->width);
            out.push_back(std::move(*primvar));
        } else if (is_empty(ctx, source)) {
            continue;
        }
        told.insert(source.name);
    }
    warn_missing(ctx, prim, materials, told);
    warn_tangents(ctx, prim, materials, out);
    return out;
}

void add_object_space(Context& ctx,
                      const std::vector<const materials::MaterialEntry*>& materials,
                      const Mat4d& matrix,
                      std::vector<scene::Primvar>& primvars) {
    const std::string first(scene::object_space_primvars[0]);
    const bool is_asked_for =
        std::any_of(materials.begin(), materials.end(), [&](const materials::MaterialEntry* m) {
            return std::find(m->primvars.begin(), m->primvars.end(), first) != m->primvars.end();
        });
    if (!is_asked_for || !keeps_a_surface(matrix)) return;
    const Mat4d inverse = matrix.inverse();
    for (int c = 0; c < 3; ++c) {
        scene::Primvar row;
        row.name = scene::intern_primvar(ctx.scene, scene::object_space_primvars[size_t(c)]);
        row.width = 4;
        for (int i = 0; i < 4; ++i) row.values.push_back(float(inverse[i][c]));
        primvars.push_back(std::move(row));
    }
}

}  // namespace velatura::translate::geometry
