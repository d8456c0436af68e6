// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Weights of multiple importance sampling for one sample of each of two strategies (Veach 1997,
/// chapter 9). Finite for every pair of non-negative densities, zeros, denormals and infinity
/// included; the weights of the two strategies sum to 1. Delta lobes and delta lights are flags,
/// never large densities.
namespace velatura::sampling {

/// pdf / (pdf + other), the balance heuristic.
inline float balance_heuristic(float pdf, float other) {
    if (pdf == other) return 0.5f;
    if (pdf > other) return 1.0f / (1.0f + other / pdf);
    const float ratio = pdf / other;
    return ratio / (1.0f + ratio);
}

/// pdf² / (pdf² + other²), the power heuristic.
inline float power_heuristic(float pdf, float other) {
    if (pdf == other) return 0.5f;
    if (pdf > other) {
        const float ratio = other / pdf;
        return 1.0f / (1.0f + ratio * ratio);
    }
    const float ratio = pdf / other;
    return (ratio * ratio) / (1.0f + ratio * ratio);
}

/// Density p for which f² / p is what one sample of each strategy, weighted by the power heuristic,
/// adds to the second moment at a point of value f: (pdf² + other²)² / (pdf³ + other³). At most
/// pdf + other, which is that of the balance heuristic.
inline float power_heuristic_density(float pdf, float other) {
    const float larger = pdf > other ? pdf : other;
    if (!(larger > 0.0f)) return 0.0f;
    const float ratio = (pdf > other ? other : pdf) / larger, squared = ratio * ratio;
    return larger * ((1.0f + squared) * (1.0f + squared) / (1.0f + squared * ratio));
}

}  // namespace velatura::sampling
