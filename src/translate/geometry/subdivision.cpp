// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/subdivision.h"

#include "translate/context/values.h"
#include "translate/geometry/mesh_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_set>
#include <utility>

namespace velatura::translate::geometry {

namespace {

template <class Enum>
using Names = std::vector<std::pair<std::string_view, Enum>>;

/// The value of a token; the first of `names` is what is taken for unknown ones.
template <class Enum>
Enum read_token(Context& ctx, Prim prim, const char* attribute_name, const Names<Enum>& names) {
    const Attribute attribute = prim.attribute(attribute_name);
    const std::string token = read_text(attribute, names[0].first, ctx.time);
    for (const auto& [name, value] : names)
        if (token == name) return value;
    ctx.warn(
        "bad-subdivision", attribute,
        fmt::format("{} \"{}\" is unknown, {} is used", attribute_name, token, names[0].first));
    return names[0].second;
}

std::vector<float> read_sharpnesses(Context& ctx, const Attribute& attribute) {
    std::vector<float> values;
    int width = 0;
    if (!read_rows(attribute.value(ctx.time), values, width) || width != 1) values.clear();
    // Not a number counts as smooth
    for (float& value : values) value = value > 0.0f ? value : 0.0f;
    return values;
}

uint64_t edge_key(uint32_t a, uint32_t b) {
    return (uint64_t(std::min(a, b)) << 32) | std::max(a, b);
}

std::unordered_set<uint64_t> edges_of(const FaceTable& table) {
    std::unordered_set<uint64_t> edges;
    for (const FaceTable::Face& face : table.faces) {
        if (!face.is_kept) continue;
        for (size_t i = 0; i < face.count; ++i)
            edges.insert(edge_key(table.indices[face.first + i],
                                  table.indices[face.first + (i + 1) % face.count]));
    }
    return edges;
}

/// Chains of vertices with one sharpness for each, or one for each of their edges.
void read_creases(Context& ctx, Prim prim, const FaceTable& table, scene::SubdivisionRules& rules) {
    const Attribute attribute = prim.attribute("creaseIndices");
    const auto indices = read_ints(attribute.value(ctx.time));
    const auto lengths = read_ints(prim.attribute("creaseLengths").value(ctx.time));
    const auto sharpnesses = read_sharpnesses(ctx, prim.attribute("creaseSharpnesses"));
    if (indices.empty() && lengths.empty()) return;
    size_t total = 0, edge_count = 0;
    bool has_good_lengths = true;
    for (const int64_t length : lengths) {
        has_good_lengths = has_good_lengths && length >= 2 && size_t(length) <= indices.size();
        if (!has_good_lengths) break;
        total += size_t(length);
        edge_count += size_t(length) - 1;
    }
    const bool is_by_crease = sharpnesses.size() == lengths.size();
    if (!has_good_lengths || total != indices.size() ||
        (!is_by_crease && sharpnesses.size() != edge_count)) {
        ctx.warn("bad-subdivision", attribute,
                 fmt::format("{} creaseIndices, {} creaseLengths, {} creaseSharpnesses do not "
                             "match; all creases are ignored",
                             indices.size(), lengths.size(), sharpnesses.size()));
        return;
    }
    const auto edges = edges_of(table);
    size_t absent = 0, first = 0, edge = 0;
    for (size_t c = 0; c < lengths.size(); ++c) {
        for (size_t i = first; i + 1 < first + size_t(lengths[c]); ++i, ++edge) {
            const uint32_t a = uint32_t(indices[i]), b = uint32_t(indices[i + 1]);
            const bool is_edge = int64_t(a) == indices[i] && int64_t(b) == indices[i + 1] &&
                                 edges.contains(edge_key(a, b));
            absent += !is_edge;
            if (!is_edge) continue;
            rules.creases.push_back({a, b});
            rules.crease_sharpnesses.push_back(sharpnesses[is_by_crease ? c : edge]);
        }
        first += size_t(lengths[c]);
    }
    if (absent > 0)
        ctx.warn("bad-subdivision", attribute,
                 fmt::format("{} of {} creases are ignored: not on an edge of the mesh", absent,
                             edge_count));
}

void read_corners(Context& ctx, Prim prim, size_t point_count, scene::SubdivisionRules& rules) {
    const Attribute attribute = prim.attribute("cornerIndices");
    const auto indices = read_ints(attribute.value(ctx.time));
    const auto sharpnesses = read_sharpnesses(ctx, prim.attribute("cornerSharpnesses"));
    if (indices.empty()) return;
    if (sharpnesses.size() != indices.size()) {
        ctx.warn("bad-subdivision", attribute,
                 fmt::format("{} cornerIndices and {} cornerSharpnesses: all corners are ignored",
                             indices.size(), sharpnesses.size()));
        return;
    }
    size_t absent = 0;
    for (size_t i = 0; i < indices.size(); ++i) {
        const bool is_vertex = indices[i] >= 0 && size_t(indices[i]) < point_count;
        absent += !is_vertex;
        if (!is_vertex) continue;
        rules.corners.push_back(uint32_t(indices[i]));
        rules.corner_sharpnesses.push_back(sharpnesses[i]);
    }
    if (absent > 0)
        ctx.warn("bad-subdivision", attribute,
                 fmt::format("{} of {} corners are ignored: not a point of the mesh", absent,
                             indices.size()));
}

}  // namespace

scene::SubdivisionScheme read_scheme(Context& ctx, Prim prim) {
    using enum scene::SubdivisionScheme;
    static const Names<scene::SubdivisionScheme> names = {
        {"catmullClark", CatmullClark}, {"loop", Loop}, {"bilinear", Bilinear}, {"none", None}};
    return read_token(ctx, prim, "subdivisionScheme", names);
}

std::vector<size_t> read_holes(Context& ctx, Prim prim, size_t face_count) {
    const Attribute attribute = prim.attribute("holeIndices");
    std::vector<size_t> holes;
    for (const int64_t face : read_ints(attribute.value(ctx.time))) {
        if (face < 0 || size_t(face) >= face_count)
            ctx.warn(
                "bad-topology", attribute,
                fmt::format("hole index {} is not a face of {}; it is ignored", face, face_count));
        else
            holes.push_back(size_t(face));
    }
    std::sort(holes.begin(), holes.end());
    holes.erase(std::unique(holes.begin(), holes.end()), holes.end());
    return holes;
}

scene::SubdivisionRules read_subdivision_rules(Context& ctx,
                                               Prim prim,
                                               const FaceTable& table,
                                               size_t point_count) {
    using Boundary = scene::BoundaryInterpolation;
    using FaceVarying = scene::FaceVaryingInterpolation;
    static const Names<Boundary> boundaries = {{"edgeAndCorner", Boundary::EdgeAndCorner},
                                               {"edgeOnly", Boundary::EdgeOnly},
                                               {"none", Boundary::None}};
    static const Names<FaceVarying> face_varying = {
        {"cornersPlus1", FaceVarying::CornersPlus1}, {"none", FaceVarying::None},
        {"cornersOnly", FaceVarying::CornersOnly},   {"cornersPlus2", FaceVarying::CornersPlus2},
        {"boundaries", FaceVarying::Boundaries},     {"all", FaceVarying::All}};
    static const Names<scene::TriangleRule> triangles = {
        {"catmullClark", scene::TriangleRule::CatmullClark},
        {"smooth", scene::TriangleRule::Smooth}};
    scene::SubdivisionRules rules;
    rules.boundary = read_token(ctx, prim, "interpolateBoundary", boundaries);
    rules.face_varying = read_token(ctx, prim, "faceVaryingLinearInterpolation", face_varying);
    rules.triangles = read_token(ctx, prim, "triangleSubdivisionRule", triangles);
    read_creases(ctx, prim, table, rules);
    read_corners(ctx, prim, point_count, rules);

    // Holes go by the numbers that faces have once the bad ones are left out
    const std::vector<size_t> holes = read_holes(ctx, prim, table.faces.size());
    size_t kept = 0, next = 0;
    for (size_t f = 0; f < table.faces.size() && next < holes.size(); ++f) {
        const bool is_hole = holes[next] == f;
        next += is_hole;
        if (is_hole && table.faces[f].is_kept) rules.holes.push_back(uint32_t(kept));
        kept += table.faces[f].is_kept;
    }
    return rules;
}

}  // namespace velatura::translate::geometry
