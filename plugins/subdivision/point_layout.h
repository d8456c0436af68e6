// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/subdivision/shared_points.h"

#include <opensubdiv/bfr/tessellation.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace velatura::plugins::subdivision {

/// Where the points of a diced cage stand among its vertices: first the wedges, then the inner
/// points of edges, then those of faces.
struct PointLayout {
    std::vector<uint32_t> run_of_corner;   ///< [corner] first inner point of its edge, in its copy
    std::vector<uint8_t> owns_run;         ///< [corner] its face makes these points
    std::vector<uint64_t> first_interior;  ///< [face] and one more
    std::vector<uint64_t> first_triangle;  ///< [face] and one more
    std::vector<std::array<uint32_t, 2>> twins;  ///< as in geometry::DicedMesh

    uint64_t point_count() const { return first_interior.back(); }

    uint64_t triangle_count() const { return first_triangle.back(); }
};

/// How a face is cut whose edges are cut into rates[edge] pieces.
Bfr::Tessellation pattern_of(const SharedPoints& shared,
                             const Bfr::Parameterization& parameterization,
                             uint32_t face,
                             std::span<const uint32_t> rates);

/// Nothing where there would be more points or triangles than 32 bits count.
std::optional<PointLayout> lay_out(const Cage& cage,
                                   const SharedPoints& shared,
                                   std::span<const uint32_t> rates);

}  // namespace velatura::plugins::subdivision
