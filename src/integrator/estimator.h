// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::integrator {

/// Who looks for the lights that a vertex sees. All three have the same mean (Veach 1997, chapter
/// 9).
enum class LightSampling : uint8_t {
    Mis,    ///< light and BSDF sampling, weighed by the balance heuristic
    Light,  ///< light sampling alone; lights met by BSDF sampling do not count, but behind delta
            ///< lobes
    Bsdf,   ///< BSDF sampling alone; lights without extent, which it cannot meet, are still sampled
};

/// How paths end. All are unbiased but for `None` together with a depth limit.
enum class Roulette : uint8_t {
    Throughput,  ///< survival = twice what the path still carries, largest channel; where paths are
                 ///< guided, twice what it may still bring when that is more
    Constant,    ///< survival = constant_survival, whatever it carries
    None,        ///< paths end by absorption and by the depth limit alone
};

inline constexpr float constant_survival = 0.75f;

/// Which estimator of the light transport is run. The defaults are the best; the others are the
/// classic ones to compare with.
struct EstimatorOptions {
    LightSampling light_sampling = LightSampling::Mis;
    Roulette roulette = Roulette::Throughput;
    int roulette_start =
        3;  ///< scatterings before roulette begins: short paths carry most of the light
    /// Whitted 1980: only chains of perfect mirrors and refractions are followed; all else ends
    /// with its direct light. A picture of its own: indirect light by diffuse and rough surfaces is
    /// missing.
    bool specular_chains_only = false;
};

}  // namespace velatura::integrator
