// SPDX-License-Identifier: Apache-2.0
#include "integrator/roulette.h"

#include "integrator/classic/survival.h"

#include <utility>

namespace velatura::integrator {

bool survives_otherwise(const TracerContext& context, Path& path) {
    const EstimatorOptions& estimator = context.options.estimator;
    const float whole = context.world.camera.exposure_scale() * path.share;
    const float carried = max_component(path.beta) * path.eta_scale / whole;
    const float carried_before = std::exchange(path.carried, carried);
    float survival = 1.0f;
    switch (estimator.roulette) {
        case Roulette::None:
            return true;
        case Roulette::Cutoff:
            return classic::survives_cutoff(carried, estimator.cutoff);
        case Roulette::Albedo:
            survival = classic::albedo_survival(carried, carried_before);
            break;
        case Roulette::Constant:
            survival = classic::constant_survival;
            break;
        case Roulette::Throughput:
        case Roulette::Efficiency:
            survival =
                carried *
                (context.options.roulette ? context.options.roulette->at(path.bounce) : usual_gain);
            break;
    }
    if (path.bounce >= trapped_path_start)
        survival = std::min(survival, 1.0f - 1.0f / trapped_path_share);
    // Gains of a trial know how much short paths carry
    const bool can_end = path.bounce >= estimator.roulette_start ||
                         (estimator.roulette == Roulette::Efficiency && context.options.roulette);
    if (can_end && survival < 1.0f) {
        scene::count_call(scene::Effect::Roulette);
        if (path.sampler.get_1d(path.bounce, sampling::Purpose::Roulette) >= survival) return false;
        path.beta /= survival;
        path.carried /= survival;
    }
    if (path.observer) path.observer->on_survival(path.bounce, path.carried);
    return true;
}

}  // namespace velatura::integrator
