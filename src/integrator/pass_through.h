// SPDX-License-Identifier: Apache-2.0
// Surfaces that a path meets and that do not scatter it.
#pragma once

#include "integrator/path.h"
#include "integrator/tracer_context.h"

#include <optional>

namespace velatura::integrator {

/// Whether the path goes through a cut-out, by chance in proportion to what is absent.
bool pass_cutout(const TracerContext& context, Path& path, const geometry::SurfacePoint& point);

/// Goes on with all the light that passes the vertex straight, and with nothing else. False: none
/// does.
bool pass_straight(const TracerContext& context, Path& path, const Vertex& vertex);

/// Nested dielectrics. False: what was met is no boundary between solids, and the path goes on.
/// crossing: if it is one, made in `storage`.
bool intersect_dielectrics(const TracerContext& context,
                           Path& path,
                           const geometry::SurfacePoint& point,
                           std::optional<NestedDielectrics::Crossing>& storage,
                           const NestedDielectrics::Crossing*& crossing);

}  // namespace velatura::integrator
