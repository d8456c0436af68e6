// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path.h"
#include "integrator/tracer_context.h"

#include <optional>

namespace velatura::integrator {

/// Where a path comes out that scattered below the surface: a vertex in place of the one where it
/// went in.
struct SubsurfaceExit {
    SubsurfaceExit(const geometry::SurfacePoint& at,
                   const Vec3& wo,
                   const guiding::GuidingField* guide)
        : point(at),
          bsdf(Rgb(1.0f), at.ng, at.ns, wo, at.side != 0 ? at.ns : at.ng),
          vertex{point, bsdf, wo, DirectionMixture(bsdf, wo, at.p, guide), nullptr, true} {}

    SubsurfaceExit(const SubsurfaceExit&) = delete;
    SubsurfaceExit& operator=(const SubsurfaceExit&) = delete;

    geometry::SurfacePoint point;
    shading::Bsdf bsdf;
    Vertex vertex;
};

/// Chooses between scattering at the vertex and below it. False: absorbed there. out: where the
/// path came out, if it went in.
bool scatter_below(const TracerContext& context,
                   Path& path,
                   const Vertex& vertex,
                   std::optional<SubsurfaceExit>& out);

}  // namespace velatura::integrator
