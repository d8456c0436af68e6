// SPDX-License-Identifier: Apache-2.0
#include "integrator/caustic_light.h"

#include "integrator/deposit.h"
#include "scene/effect_calls.h"

namespace velatura::integrator {

void add_caustics(const TracerContext& context,
                  Path& path,
                  const Vertex& vertex,
                  film::SampleRadiance& out) {
    scene::count_call(scene::Effect::CausticSearch);
    const CausticSampler::Receiver receiver{
        vertex.point, vertex.bsdf, vertex.wo, {path.cone_width, path.cone_spread}, path.interior};
    const auto found = context.options.caustics->sample(receiver, path.sampler, path.bounce,
                                                        path.pass_count, *path.counts);
    if (!found) return;
    const int bounce = path.bounce + 1 + found->events.count;
    if (bounce > context.depth_limit) return;
    film::PathLabels* const labels = out.labels();
    if (labels) {
        labels->look(vertex.events(vertex.bsdf.evaluate(vertex.wo, found->wi)));
        for (size_t i = 0; i < size_t(found->events.count); ++i)
            labels->look_on(events_of(found->events.events[i].kind, found->coats[i]));
    }
    deposit(path, bounce, context.world.lights.group(found->light), path.beta * found->radiance,
            "caustic solved for", out);
    if (labels) labels->stay();
}

}  // namespace velatura::integrator
