// SPDX-License-Identifier: Apache-2.0
#include "integrator/subsurface_exit.h"

#include "integrator/specular_chain.h"

namespace velatura::integrator {

bool scatter_below(const TracerContext& context,
                   Path& path,
                   const Vertex& vertex,
                   std::optional<SubsurfaceExit>& out) {
    const shading::Subsurface below =
        context.world.materials.subsurface(vertex.point, path.cone_width);
    const Rgb entering = vertex.bsdf.entering() * below.weight;
    const float share = luminance(entering * below.color);
    if (!(share > 0.0f)) return true;
    const float probability = share / (share + luminance(vertex.bsdf.albedo()));
    if (path.sampler.get_1d(path.bounce, sampling::Purpose::SubsurfaceSelect, path.pass_count) >=
        probability) {
        path.beta /= 1.0f - probability;
        return true;
    }
    const auto exit =
        context.world.subsurface->walk(vertex.point, vertex.bsdf.ns(), vertex.wo, below,
                                       path.sampler, path.bounce, path.pass_count, *path.counts);
    if (!exit) return false;
    path.beta *= entering * exit->throughput / probability;
    const std::optional<geometry::SurfacePoint> moved =
        leaving_point(context.world, exit->point, exit->wo, path.counts->shadow);
    out.emplace(moved ? *moved : exit->point, exit->wo, context.options.guide);
    return true;
}

}  // namespace velatura::integrator
