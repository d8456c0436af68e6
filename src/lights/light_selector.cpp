// SPDX-License-Identifier: Apache-2.0
#include "lights/light_selector.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// Weights of the lights that are on; all 1 when the powers cannot be compared.
std::vector<double> powers_of(const LightSet& lights,
                              const std::vector<uint32_t>& on,
                              const Box3& bounds) {
    const Vec3d size(bounds.isEmpty() ? Vec3(0.0f) : bounds.size());
    const double radius = 0.5 * std::sqrt(size.dot(size));
    std::vector<double> powers;
    double sum = 0.0;
    for (const uint32_t light : on) {
        powers.push_back(lights.power(light, radius));
        sum += powers.back();
    }
    if (!(sum > 0.0) || !std::isfinite(sum)) std::fill(powers.begin(), powers.end(), 1.0);
    return powers;
}

}  // namespace

LightSelector::LightSelector(const LightSet& lights,
                             const Box3& scene_bounds,
                             const SelectorOptions& options) {
    for (uint32_t i = 0; i < lights.size(); ++i)
        if (lights.is_on(i)) on_.push_back(i);
    pmf_.assign(lights.size(), 0.0f);
    if (on_.empty()) return;

    const double count = double(on_.size());
    std::vector<double> weights(on_.size(), 1.0 / count);
    if (options.kind == SelectionKind::Power) {
        const std::vector<double> powers = powers_of(lights, on_, scene_bounds);
        double sum = 0.0;
        for (const double p : powers) sum += p;
        const double uniform = std::clamp(options.uniform_part, 1e-3, 1.0);
        for (size_t i = 0; i < on_.size(); ++i)
            weights[i] = uniform / count + (1.0 - uniform) * (powers[i] / sum);
    }
    double sum = 0.0;
    for (const double w : weights) sum += w;
    double running = 0.0;
    for (size_t i = 0; i < on_.size(); ++i) {
        running += weights[i] / sum;
        cdf_.push_back(running);
        pmf_[on_[i]] = float(weights[i] / sum);
    }
    cdf_.back() = 1.0;
}

std::optional<LightChoice> LightSelector::select(const Vec3&, float u) const {
    if (cdf_.empty()) return std::nullopt;
    const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), double(u));
    const size_t i = std::min(size_t(it - cdf_.begin()), cdf_.size() - 1);
    return LightChoice{on_[i], pmf_[on_[i]]};
}

float LightSelector::pmf(const Vec3&, uint32_t light) const {
    return pmf_[light];
}

}  // namespace velatura::lights
