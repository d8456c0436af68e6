// SPDX-License-Identifier: Apache-2.0
// How paths end that do not end by the default roulette.
#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/roulette_gains.h"
#include "scene/effect_calls.h"

#include <utility>

namespace velatura::integrator {

bool PathTracer::survives_otherwise(Path& path) const {
    const EstimatorOptions& estimator = options_.estimator;
    const float whole = world_.camera.exposure_scale() * path.share;
    const float carried = max_component(path.beta) * path.eta_scale / whole;
    const float carried_before = std::exchange(path.carried, carried);
    float survival = 1.0f;
    switch (estimator.roulette) {
        case Roulette::None:
            return true;
        case Roulette::Cutoff:
            return !(carried < estimator.cutoff);
        case Roulette::Albedo:
            survival = carried / carried_before;
            break;
        case Roulette::Constant:
            survival = constant_survival;
            break;
        case Roulette::Throughput:
        case Roulette::Efficiency:
            survival =
                carried * (options_.roulette ? options_.roulette->at(path.bounce) : usual_gain);
            break;
    }
    if (path.bounce >= trapped_path_start)
        survival = std::min(survival, 1.0f - 1.0f / trapped_path_share);
    // Gains of a trial know how much short paths carry
    const bool may_end = path.bounce >= estimator.roulette_start ||
                         (estimator.roulette == Roulette::Efficiency && options_.roulette);
    if (may_end && survival < 1.0f) {
        scene::count_call(scene::Effect::Roulette);
        if (path.sampler.get_1d(path.bounce, sampling::Purpose::Roulette) >= survival) return false;
        path.beta /= survival;
        path.carried /= survival;
    }
    if (path.observer) path.observer->on_survival(path.bounce, path.carried);
    return true;
}

}  // namespace velatura::integrator
