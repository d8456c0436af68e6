// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path.h"
#include "integrator/tracer_context.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

/// A path that may bring half of what it set out with, or more, does not end by roulette.
inline constexpr float importance_scale = 2.0f;

/// By a roulette that has no gains.
bool survives_otherwise(const TracerContext& context, Path& path);

/// Whether the path goes on; its weight makes up for those that do not.
inline bool survives_roulette(const TracerContext& context, Path& path) {
    const EstimatorOptions& estimator = context.options.estimator;
    if (!has_gains(estimator.roulette)) return survives_otherwise(context, path);
    const RouletteGains* const gains = context.options.roulette;
    const float whole = context.world.camera.exposure_scale() * path.share;
    float carried = max_component(path.beta) * path.eta_scale / whole;
    float survival = (gains ? gains->at(path.bounce) : usual_gain) * carried;
    // A dim path on its way to where much light is must not end: keep it by what it may bring
    // (Vorba & Křivánek 2016, without splitting). What was learned never makes a path end earlier.
    if (std::isfinite(path.importance))
        survival = std::max(survival, importance_scale * path.importance);
    if (path.bounce >= trapped_path_start)
        survival = std::min(survival, 1.0f - 1.0f / trapped_path_share);
    // Gains of a trial know how much short paths carry
    const bool can_end = gains || path.bounce >= estimator.roulette_start;
    if (can_end && survival < 1.0f) {
        scene::count_call(scene::Effect::Roulette);
        if (path.sampler.get_1d(path.bounce, sampling::Purpose::Roulette) >= survival) return false;
        path.beta /= survival;
        carried /= survival;
    }
    if (path.observer) path.observer->on_survival(path.bounce, carried);
    return true;
}

}  // namespace velatura::integrator
