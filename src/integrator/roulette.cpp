// SPDX-License-Identifier: Apache-2.0
#include "integrator/roulette.h"

#include "base/check.h"
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
            VELATURA_CHECK(false, "a roulette with gains");
    }
    if (path.bounce >= trapped_path_start)
        survival = std::min(survival, 1.0f - 1.0f / trapped_path_share);
    if (path.bounce >= estimator.roulette_start && survival < 1.0f) {
        scene::count_call(scene::Effect::Roulette);
        if (path.sampler.get_1d(path.bounce, sampling::Purpose::Roulette) >= survival) return false;
        path.beta /= survival;
        path.carried /= survival;
    }
    return true;
}

}  // namespace velatura::integrator
