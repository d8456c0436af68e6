// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/top_up.h"

#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace velatura::compositor::noise {

namespace {

double mean_of(const std::vector<uint64_t>& counts) {
    const double sum = std::accumulate(counts.begin(), counts.end(), 0.0);
    return sum / double(std::max<size_t>(counts.size(), 1));
}

/// Squared error of each pixel relative to `base`, mean of its channels.
std::vector<double> squares_of(const MixError& mix, const std::array<std::vector<float>, 3>& base) {
    std::vector<double> squares(mix.share.size());
    for (size_t i = 0; i < squares.size(); ++i)
        for (size_t c = 0; c < 3; ++c)
            squares[i] += statistics::relative_square(mix.variance(c, i), double(base[c][i])) / 3;
    return squares;
}

/// What a request for some number of samples leaves of the error.
class Outlook {
  public:
    Outlook(const image::Window& window,
            const MixError& mix,
            const std::vector<uint64_t>& counts,
            const std::vector<float>& priority)
        : window_(window),
          counts_(counts),
          priority_(priority),
          squares_(squares_of(mix, mix.base)) {}

    /// √relMSE with `samples` per pixel in the mean.
    double error_at(double samples) const {
        const auto placed = layers::place_samples(window_, priority_, counts_, samples);
        double sum = 0;
        for (size_t i = 0; i < squares_.size(); ++i) {
            if (placed[i] > 0) sum += squares_[i] * double(counts_[i]) / double(placed[i]);
        }
        return std::sqrt(sum / double(squares_.size()));
    }

    /// Samples per pixel that reach an error; never fewer than are there.
    double samples_for(double target) const {
        double low = mean_of(counts_), high = 2 * low;
        if (error_at(low) <= target) return low;
        while (error_at(high) > target && high < max) low = high, high *= 2;
        constexpr int halvings = 12;
        for (int i = 0; i < halvings; ++i) {
            const double middle = (low + high) / 2;
            (error_at(middle) <= target ? high : low) = middle;
        }
        return std::ceil(high);
    }

  private:
    static constexpr double max = 0x1p31;

    const image::Window& window_;
    const std::vector<uint64_t>& counts_;
    const std::vector<float>& priority_;
    std::vector<double> squares_;
};

}  // namespace

std::vector<float> top_up_priority(const image::Window& window,
                                   const MixError& mix,
                                   const std::vector<uint64_t>& counts) {
    const int width = window.width(), height = window.height();
    constexpr int reach = layers::top_up_reach;
    // Relative to each pixel's own mean. MixError::base depends on the pixels around: by that, a
    // pixel's own samples would decide on its priority, which biases its mean
    std::vector<double> errors = squares_of(mix, mix.mean);
    for (size_t i = 0; i < errors.size(); ++i) errors[i] *= double(counts[i]);
    std::vector<float> priority(errors.size());
    parallel_for(size_t(height), [&](size_t row) {
        const int y = int(row);
        const int y0 = std::max(0, y - reach), y1 = std::min(height, y + reach + 1);
        for (int x = 0; x < width; ++x) {
            const int x0 = std::max(0, x - reach), x1 = std::min(width, x + reach + 1);
            // Summed without the pixel itself: what is added and taken away again leaves its
            // rounding
            double sum = 0;
            for (int v = y0; v < y1; ++v) {
                for (int u = x0; u < x1; ++u)
                    if (u != x || v != y) sum += errors[size_t(v) * size_t(width) + size_t(u)];
            }
            const int others = (x1 - x0) * (y1 - y0) - 1;
            if (others > 0)
                priority[row * size_t(width) + size_t(x)] = float(std::sqrt(sum / double(others)));
        }
    });
    return priority;
}

Result<TopUpPlan> plan_top_up(const LayerStack& stack,
                              const std::vector<uint64_t>& counts,
                              const Look& look,
                              const TopUpGoal& goal) {
    auto forecast = forecast_noise(stack, look, goal.target);
    if (!forecast) return forecast.error();
    TopUpPlan plan;
    plan.forecast = std::move(*forecast);
    plan.samples_now = mean_of(counts);
    layers::TopUpRequest& request = plan.request;
    const layers::SampleInfo& samples = stack.header().samples;
    request.scene_hash = samples.scene_hash;
    request.settings_hash = samples.settings_hash;
    request.look_json = look_to_json(look);
    request.window = stack.image().data;
    request.present = counts;
    request.priority = top_up_priority(request.window, plan.forecast.error, counts);

    const Outlook outlook(request.window, plan.forecast.error, counts, request.priority);
    if (goal.samples) {
        request.samples = *goal.samples;
    } else {
        plan.target = plan.forecast.advice.target;
        request.samples = outlook.samples_for(plan.target);
    }
    plan.error_after = outlook.error_at(request.samples);
    const double ratio = plan.error_after > 0 ? plan.forecast.mix.value / plan.error_after : 1;
    plan.samples_evenly = plan.samples_now * ratio * ratio;
    return plan;
}

}  // namespace velatura::compositor::noise
