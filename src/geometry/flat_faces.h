// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/subdivider.h"
#include "scene/mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace velatura::geometry {

/// [face] whether the face of the limit surface lies in a plane within straight sides, with one
/// normal, and all its primvars are affine functions of the place: two triangles show it as exactly
/// as any number. Only faces that `rates` ([edge] pieces) cut into many triangles are looked at, by
/// a trial of a few points each, and only where the trial is cheap beside what it can save; nothing
/// otherwise, and of meshes that move.
/// Space: shape. Nothing as well where the trial fails.
std::vector<uint8_t> flat_faces(const scene::Mesh& mesh,
                                const LimitSurface& surface,
                                std::span<const uint32_t> rates);

/// One piece for every edge all of whose faces are flat. is_flat: as above; empty = none.
void spare_flat_edges(const scene::Mesh& mesh,
                      const LimitSurface& surface,
                      std::span<const uint8_t> is_flat,
                      std::span<uint32_t> rates);

}  // namespace velatura::geometry
