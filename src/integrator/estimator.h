// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::integrator {

/// Who looks for the lights that a vertex sees. All have the same mean (Veach 1997, chapter 9).
enum class LightSampling : uint8_t {
    Mis,    ///< light and BSDF sampling, weighed by the power heuristic
    Light,  ///< light sampling alone; lights met by BSDF sampling do not count, but behind delta
            ///< lobes
    Bsdf,   ///< BSDF sampling alone; lights without extent, which it cannot meet, are still sampled
    Hemisphere,  ///< a direction of its own, uniform over the hemisphere that the vertex sees (the
                 ///< sphere where light may come from everywhere), finds what lies along it; met
                 ///< lights count as for Light, lights without extent as for Bsdf
    Cosine,      ///< the same by the cosine
};

/// Lights are looked for by a direction of the vertex's own.
constexpr bool looks_around(LightSampling sampling) {
    return sampling == LightSampling::Hemisphere || sampling == LightSampling::Cosine;
}

/// Sampled lights that a direction can meet do not count.
constexpr bool is_left_to_bsdf_sampling(LightSampling sampling) {
    return sampling == LightSampling::Bsdf || looks_around(sampling);
}

/// How paths end. All are unbiased but for `None` together with a depth limit, and `Cutoff`.
enum class Roulette : uint8_t {
    Throughput,  ///< survival = twice what the path still carries, largest channel; where paths are
                 ///< guided, twice what it may still bring when that is more
    Albedo,      ///< survival = what the last scattering and the way there left of it
    Efficiency,  ///< as Throughput, with a factor found by trial paths in place of twice, for each
                 ///< number of scatterings; see RouletteTrial
    Constant,    ///< survival = classic::constant_survival, whatever it carries
    Cutoff,      ///< none below EstimatorOptions::cutoff of what the path began with: a bias
    None,        ///< paths end by absorption and by the depth limit alone
};

/// Whether it is a roulette at all.
constexpr bool has_chances_to_end(Roulette roulette) {
    return roulette != Roulette::None && roulette != Roulette::Cutoff;
}

/// Whether survival is a gain times what the path still carries.
constexpr bool has_gains(Roulette roulette) {
    return roulette == Roulette::Throughput || roulette == Roulette::Efficiency;
}

/// Which estimator of the light transport is run. The defaults are the best; the others are the
/// classic ones to compare with.
struct EstimatorOptions {
    LightSampling light_sampling = LightSampling::Mis;
    Roulette roulette = Roulette::Efficiency;
    int roulette_start = 3;  ///< scatterings before roulette begins: short paths carry most of the
                             ///< light; none where a trial told what they carry
    float cutoff = 0.01f;    ///< of Roulette::Cutoff, which has no such start
    /// Whitted 1980: only chains of perfect mirrors and refractions are followed; all else ends
    /// with its direct light. An image of its own: indirect light by diffuse and rough surfaces is
    /// missing.
    bool specular_chains_only = false;
};

}  // namespace velatura::integrator
