// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/matte_kind.h"
#include "integrator/path.h"
#include "integrator/tracer_context.h"

#include <array>
#include <cstdint>

namespace velatura::integrator {

/// Ids of what a camera sample sees through clear surfaces, or in mirrors, as the options let
/// mattes pass: of the first surface that scatters in another way, all 0 where there is none. The
/// refracted or reflected direction is followed whatever the path samples, so mattes have no noise
/// of the choice. Volumes behind the first surface do not count (docs/adr/0061). Args: path: at its
/// first surface `point`, where `vertex` scatters.
std::array<uint32_t, accumulate::matte_kinds.size()> matte_ids_seen_through(
    const TracerContext& context,
    const Path& path,
    const geometry::SurfacePoint& point,
    const Vertex& vertex);

}  // namespace velatura::integrator
