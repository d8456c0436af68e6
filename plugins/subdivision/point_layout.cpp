// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/point_layout.h"

#include "base/tasks.h"
#include "scene/ids.h"

#include <limits>

namespace velatura::plugins::subdivision {

namespace {

/// Gives the inner points of every edge their places, from `next` on; returns where they end.
uint64_t lay_out_edges(const SharedPoints& shared,
                       std::span<const uint32_t> rates,
                       uint64_t next,
                       PointLayout& layout) {
    std::vector<uint32_t> leading_run(shared.edge_count(), scene::none);
    layout.run_of_corner.assign(shared.edge_of_corner.size(), scene::none);
    layout.owns_run.assign(shared.edge_of_corner.size(), 0);
    for (size_t f = 0; f < shared.has_face.size(); ++f) {
        if (!shared.has_face[f]) continue;
        for (uint32_t c = shared.first_corner[f]; c < shared.first_corner[f + 1]; ++c) {
            const uint32_t edge = shared.edge_of_corner[c];
            const uint32_t inner = rates[edge] - 1;
            const bool is_first = leading_run[edge] == scene::none;
            if (!is_first && !shared.is_split[edge]) {
                layout.run_of_corner[c] = leading_run[edge];
                continue;
            }
            layout.run_of_corner[c] = uint32_t(next);
            layout.owns_run[c] = 1;
            next += inner;
            if (is_first) leading_run[edge] = layout.run_of_corner[c];
            for (uint32_t i = 0; !is_first && i < inner; ++i)
                layout.twins.push_back({layout.run_of_corner[c] + i, leading_run[edge] + i});
        }
    }
    return next;
}

}  // namespace

Bfr::Tessellation pattern_of(const SharedPoints& shared,
                             const Bfr::Parameterization& parameterization,
                             uint32_t face,
                             std::span<const uint32_t> rates) {
    const uint32_t first = shared.first_corner[face];
    const uint32_t count = shared.first_corner[face + 1] - first;
    std::vector<int> of_face(count);
    for (uint32_t i = 0; i < count; ++i) of_face[i] = int(rates[shared.edge_of_corner[first + i]]);
    return {parameterization, int(count), of_face.data(), Bfr::Tessellation::Options()};
}

std::optional<PointLayout> lay_out(const Cage& cage,
                                   const SharedPoints& shared,
                                   std::span<const uint32_t> rates) {
    const size_t faces = shared.has_face.size();
    PointLayout layout;
    for (uint32_t w = 0; w < shared.wedge_count(); ++w)
        if (shared.wedge_leader[w] != w) layout.twins.push_back({w, shared.wedge_leader[w]});
    layout.first_interior.assign(faces + 1, 0);
    layout.first_triangle.assign(faces + 1, 0);
    constexpr size_t grain = 64;
    parallel_for(
        faces,
        [&](size_t f) {
            if (!shared.has_face[f]) return;
            const auto pattern = pattern_of(shared, cage.factory->GetFaceParameterization(int(f)),
                                            uint32_t(f), rates);
            layout.first_interior[f + 1] = uint64_t(pattern.GetNumInteriorCoords());
            layout.first_triangle[f + 1] = uint64_t(pattern.GetNumFacets());
        },
        grain);
    uint64_t edge_points = 0;
    for (size_t f = 0; f < faces; ++f) {
        if (!shared.has_face[f]) continue;
        for (uint32_t c = shared.first_corner[f]; c < shared.first_corner[f + 1]; ++c)
            edge_points += rates[shared.edge_of_corner[c]] - 1;
    }
    // Edges that faces share count twice here: the bound is on the safe side
    layout.first_interior[0] = shared.wedge_count() + edge_points;
    for (size_t f = 0; f < faces; ++f) {
        layout.first_interior[f + 1] += layout.first_interior[f];
        layout.first_triangle[f + 1] += layout.first_triangle[f];
    }
    constexpr uint64_t max = uint64_t(std::numeric_limits<int>::max());
    if (layout.point_count() > max || layout.triangle_count() > max) return std::nullopt;
    const uint64_t edges_end = lay_out_edges(shared, rates, shared.wedge_count(), layout);
    const uint64_t surplus = layout.first_interior[0] - edges_end;
    for (uint64_t& first : layout.first_interior) first -= surplus;
    return layout;
}

}  // namespace velatura::plugins::subdivision
