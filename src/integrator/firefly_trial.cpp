// SPDX-License-Identifier: Apache-2.0
#include "integrator/firefly_trial.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"
#include "statistics/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace velatura::integrator {
namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x66697265666c7921ull;

constexpr size_t trial_samples = 16;
constexpr int max_to_a_side = 64;  // pixels that are tried
/// The first bounce whose contributions are limited.
constexpr int first_limited = 2;
/// Limits that are tried, each by half a stop below the one before.
constexpr int limit_count = 48;
/// A limit that lowers the squared error by less is no bias worth having.
constexpr double worth_it = 0.95;

struct Contribution {
    uint32_t sample = 0;
    Rgb radiance = Rgb(0.0f);
};

/// What was found at a pixel.
struct Pixel {
    Rgb mean = Rgb(0.0f);  ///< of all light
    std::vector<Contribution> late;
    RayCounts rays;
};

/// Collects the contributions of one sample.
class Deposits final : public PathObserver {
  public:
    Deposits(Pixel& pixel, uint32_t sample) : pixel_(pixel), sample_(sample) {}

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_unlimited() override { has_limit_ = false; }

    void on_deposit(int bounce, scene::GroupId, const Rgb& radiance, const char*) override {
        if (bounce >= first_limited && has_limit_) pixel_.late.push_back({sample_, radiance});
        has_limit_ = true;
    }

    void on_end(int, const char*) override {}

  private:
    Pixel& pixel_;
    const uint32_t sample_;
    bool has_limit_ = true;  ///< what comes next
};

/// To what people can type.
float rounded(double limit) {
    constexpr double least = std::numeric_limits<float>::min(),
                     largest = std::numeric_limits<float>::max();
    return float(std::clamp(std::stod(fmt::format("{:.3g}", std::clamp(limit, least, largest))),
                            least, largest));
}

class Trial {
  public:
    Trial(const World& world, const PathTracerOptions& options, const std::atomic<bool>* stop)
        : columns_(std::min(world.scene.settings.width, max_to_a_side)),
          rows_(std::min(world.scene.settings.height, max_to_a_side)),
          pixels_(size_t(columns_) * size_t(rows_)) {
        trace(world, options, stop);
        for (Pixel& pixel : pixels_) rays += pixel.rays;
        find_brightness();
    }

    /// Mean of relative squares of pixels and channels.
    struct Squares {
        double variance = 0;  ///< of one sample
        double bias = 0;
    };

    Squares squares(float limit) const;
    float largest() const;

    RayCounts rays;

  private:
    void trace(const World& world, const PathTracerOptions& options, const std::atomic<bool>* stop);
    void find_brightness();

    int columns_, rows_;
    std::vector<Pixel> pixels_;
    std::vector<Rgb> brightness_;  ///< per pixel: median of the means around it
};

void Trial::trace(const World& world,
                  const PathTracerOptions& options,
                  const std::atomic<bool>* stop) {
    const auto& settings = world.scene.settings;
    const film::LayerSet layers = trial_layers(world.scene);
    const PathTracer tracer(world, layers, options);
    parallel_for(size_t(rows_), [&](size_t row) {
        film::SampleRadiance radiance(layers);
        for (int column = 0; column < columns_; ++column) {
            if (stop && stop->load(std::memory_order_relaxed)) return;
            Pixel& pixel = pixels_[row * size_t(columns_) + size_t(column)];
            const int x = int((2 * int64_t(column) + 1) * settings.width / (2 * columns_));
            const int y = int((2 * int64_t(row) + 1) * settings.height / (2 * rows_));
            for (uint32_t s = 0; s < trial_samples; ++s) {
                radiance.clear();
                const size_t before = pixel.late.size();
                Deposits deposits(pixel, s);
                tracer.trace(x, y, s, radiance, pixel.rays, &deposits);
                if (radiance.is_bad()) {
                    pixel.late.resize(before);
                    continue;
                }
                pixel.mean += radiance.radiance() * (1.0f / float(trial_samples));
            }
        }
    });
}

/// A firefly must not hide itself by making its pixel bright.
void Trial::find_brightness() {
    brightness_.resize(pixels_.size());
    for (int y = 0; y < rows_; ++y) {
        for (int x = 0; x < columns_; ++x) {
            for (int c = 0; c < 3; ++c) {
                std::vector<float> around;
                for (int v = std::max(y - 1, 0); v <= std::min(y + 1, rows_ - 1); ++v)
                    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, columns_ - 1); ++u)
                        around.push_back(pixels_[size_t(v * columns_ + u)].mean[c]);
                const auto middle = around.begin() + std::ptrdiff_t(around.size() / 2);
                std::nth_element(around.begin(), middle, around.end());
                brightness_[size_t(y * columns_ + x)][c] = *middle;
            }
        }
    }
}

float Trial::largest() const {
    float largest = 0;
    for (const Pixel& pixel : pixels_)
        for (const Contribution& c : pixel.late)
            largest = std::max(largest, max_component(c.radiance));
    return largest;
}

Trial::Squares Trial::squares(float limit) const {
    constexpr auto n = double(trial_samples);
    Squares out;
    double missing = 0, local_bias = 0;
    for (size_t p = 0; p < pixels_.size(); ++p) {
        if (pixels_[p].late.empty()) continue;
        std::array<std::array<double, 3>, trial_samples> kept{}, taken{};
        for (const Contribution& c : pixels_[p].late) {
            const float size = max_component(c.radiance);
            const double share = size > limit ? double(limit) / double(size) : 1.0;
            for (size_t k = 0; k < 3; ++k) {
                const auto value = double(c.radiance[int(k)]);
                kept[c.sample][k] += share * value;
                taken[c.sample][k] += (1.0 - share) * value;
            }
        }
        for (size_t k = 0; k < 3; ++k) {
            const double brightness = double(brightness_[p][int(k)]);
            double sum = 0, square = 0, sum_taken = 0, square_taken = 0;
            for (size_t s = 0; s < trial_samples; ++s) {
                sum += kept[s][k];
                square += kept[s][k] * kept[s][k];
                sum_taken += taken[s][k];
                square_taken += taken[s][k] * taken[s][k];
            }
            const double variance = (square - sum * sum / n) / (n - 1), bias = sum_taken / n,
                         chance = (square_taken - sum_taken * sum_taken / n) / (n - 1) / n;
            out.variance += statistics::relative_square(variance, brightness);
            local_bias += statistics::relative_square(bias * bias - chance, brightness);
            missing += std::sqrt(statistics::relative_square(bias * bias, brightness));
        }
    }
    const double count = 3.0 * double(pixels_.size());
    missing /= count;
    out.variance /= count;
    out.bias = std::max(local_bias / count, missing * missing);
    return out;
}

}  // namespace

FireflyTrial try_fireflies(const World& world,
                           const PathTracerOptions& options,
                           const FireflyGuard& guard,
                           const std::atomic<bool>* stop) {
    FireflyTrial out;
    const auto start = std::chrono::steady_clock::now();
    PathTracerOptions trial_options = options;
    trial_options.seed = hash_combine(options.seed, trial_seed_salt);
    trial_options.branches = nullptr;
    const Trial trial(world, trial_options, stop);
    out.rays = trial.rays;
    const bool is_stopped = stop && stop->load(std::memory_order_relaxed);
    const double variance = trial.squares(out.limit).variance;
    const float largest = trial.largest();
    if (!is_stopped && variance > 0) {
        out.samples = guard.samples > 0
                          ? guard.samples
                          : std::max(1.0, variance / (guard.target_error * guard.target_error));
        const double without = variance / out.samples;
        double best = worth_it * without;
        out.error_without = out.error_with = std::sqrt(without);
        // What is rarer than the trial has samples for. A pixel shows no more of it than of what
        // the trial met, however many samples there are
        out.limit = rounded(double(largest) * std::max(1.0, out.samples / double(trial_samples)));
        for (int i = 1; i <= limit_count; ++i) {
            const float limit = rounded(double(largest) * std::exp2(-0.5 * i));
            const Trial::Squares squares = trial.squares(limit);
            const double error = squares.bias + squares.variance / out.samples;
            if (error >= best) continue;
            best = error;
            out.limit = limit;
            out.error_with = std::sqrt(error);
            out.bias = std::sqrt(squares.bias);
        }
    }
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

std::string text_of(const FireflyTrial& trial) {
    if (!(trial.limit < std::numeric_limits<float>::infinity()))
        return "--firefly-guard: there is no light of b2 and later to clamp";
    if (trial.bias == 0)
        return fmt::format(
            "--firefly-guard: contributions of b2 and later are clamped to {:.3g}, above all that "
            "trial paths found: no lower limit has a smaller error at {:.4g} spp",
            trial.limit, trial.samples);
    return fmt::format(
        "--firefly-guard: contributions of b2 and later are clamped to {:.3g} (biased); expected "
        "error of this light at {:.4g} spp {:.2g} % instead of {:.2g} %, of which {:.2g} % bias",
        trial.limit, trial.samples, 100 * trial.error_with, 100 * trial.error_without,
        100 * trial.bias);
}

}  // namespace velatura::integrator
