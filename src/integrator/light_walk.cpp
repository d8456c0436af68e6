// SPDX-License-Identifier: Apache-2.0
#include "integrator/light_walk.h"

#include "integrator/direct_light.h"
#include "sampling/warp.h"

namespace velatura::integrator {

Look look_around(const lights::Receiver& from, LightSampling sampling, const Vec2& u) {
    if (from.n == Vec3(0.0f)) return {sampling::uniform_sphere(u), sampling::uniform_sphere_pdf};
    // One of the two sides, by what is left of the number
    const bool is_behind = from.both_sides && u.x >= 0.5f;
    const Vec2 inside(from.both_sides ? 2.0f * u.x - float(is_behind) : u.x, u.y);
    const bool by_cosine = sampling == LightSampling::Cosine;
    const Vec3 local =
        by_cosine ? sampling::cosine_hemisphere(inside) : sampling::uniform_hemisphere(inside);
    const float pdf =
        by_cosine ? sampling::cosine_hemisphere_pdf(local.z) : sampling::uniform_hemisphere_pdf;
    const Vec3 axis = is_behind ? -from.n : from.n;
    return {Frame::from_z(axis).from_local(local), from.both_sides ? 0.5f * pdf : pdf};
}

void PathTracer::add_light_around(Path& path,
                                  const Vertex& vertex,
                                  const lights::Receiver& receiver,
                                  film::SampleRadiance& out) const {
    const Vec2 u =
        path.sampler.get_2d(path.bounce, sampling::Purpose::LightDirection, path.pass_count);
    const Look look = look_around(receiver, options_.estimator.light_sampling, u);
    if (!(look.pdf > 0.0f)) return;
    for_each_light_along(path, vertex.point, receiver, look, [&](const ChosenLight& chosen) {
        deposit_sampled(path, vertex, chosen, out);
    });
}

}  // namespace velatura::integrator
