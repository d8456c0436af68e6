// SPDX-License-Identifier: Apache-2.0
#include "lights/light_selector.h"

#include "lights/light_tree.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace velatura::lights {
namespace {

std::vector<uint32_t> lights_on(const LightSet& lights) {
    std::vector<uint32_t> on;
    for (uint32_t i = 0; i < lights.size(); ++i)
        if (lights.is_on(i)) on.push_back(i);
    return on;
}

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

/// The same probabilities everywhere.
class TableSelector final : public LightSelector {
  public:
    TableSelector(const LightSet& lights, const Box3& bounds, const SelectorOptions& options)
        : on_(lights_on(lights)), pmf_(lights.size(), 0.0f) {
        const double count = double(on_.size());
        std::vector<double> weights(on_.size(), 1.0 / count);
        if (options.kind == SelectionKind::Power) {
            const std::vector<double> powers = powers_of(lights, on_, bounds);
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
        if (!cdf_.empty()) cdf_.back() = 1.0;
    }

    bool is_empty() const override { return cdf_.empty(); }

    std::optional<LightChoice> select(const Receiver&, double u) const override {
        if (cdf_.empty()) return std::nullopt;
        const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), u);
        const size_t i = std::min(size_t(it - cdf_.begin()), cdf_.size() - 1);
        return LightChoice{on_[i], pmf_[on_[i]]};
    }

    float pmf(const Receiver&, uint32_t light) const override { return pmf_[light]; }

  private:
    std::vector<double> cdf_;   // over the lights that are on, ends with 1
    std::vector<uint32_t> on_;  // their indices
    std::vector<float> pmf_;    // of every light
};

}  // namespace

std::unique_ptr<LightSelector> make_light_selector(const LightSet& lights,
                                                   const Box3& scene_bounds,
                                                   const SelectorOptions& options) {
    if (options.kind == SelectionKind::Tree)
        return std::make_unique<LightTree>(lights, lights_on(lights));
    return std::make_unique<TableSelector>(lights, scene_bounds, options);
}

}  // namespace velatura::lights
