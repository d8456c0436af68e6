// SPDX-License-Identifier: Apache-2.0
#include "integrator/roulette_trial.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"

#include <chrono>
#include <cmath>
#include <vector>

namespace velatura::integrator {
namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x726f756c65747465ull;

constexpr uint64_t trial_samples = 16;
/// Pixels that are tried: one in a cell, unless that are too many.
constexpr int cell_size = 6, max_to_a_side = 64;
/// Light that is rarer than the trial shows must not be ended more often than this.
constexpr double min_gain = 0.5, largest_gain = 64.0;

using Squares = std::array<double, 3>;

/// What one path met at its chances to end.
class Tails final : public PathObserver {
  public:
    struct Chance {
        size_t index = 0;
        double carried = 0;
        uint64_t rays_before = 0;
        Squares before = {};
    };

    explicit Tails(const RayCounts& counts) : counts_(counts) {}

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_deposit(int, scene::GroupId, const Rgb& radiance, const char*) override {
        for (size_t c = 0; c < 3; ++c) so_far_[c] += double(radiance[int(c)]);
    }

    void on_survival(int bounce, float carried) override {
        chances_.push_back(
            {RouletteGains::index(bounce), double(carried), counts_.total(), so_far_});
    }

    void on_end(int, const char*) override {}

    const std::vector<Chance>& chances() const { return chances_; }

    const Squares& total() const { return so_far_; }

  private:
    const RayCounts& counts_;
    Squares so_far_ = {};
    std::vector<Chance> chances_;
};

/// E[T² / a] and E[a c] of each index, V and C; sums.
struct Sums {
    std::array<double, RouletteGains::count> tails = {}, costs = {};
    double variance = 0, cost = 0;

    void operator+=(const Sums& o) {
        for (size_t i = 0; i < tails.size(); ++i) {
            tails[i] += o.tails[i];
            costs[i] += o.costs[i];
        }
        variance += o.variance;
        cost += o.cost;
    }

    float gain(size_t i) const {
        const double square = tails[i] / costs[i] * cost / variance;
        if (!(square > 0.0) || !std::isfinite(square)) return usual_gain;
        // Coarse: what a light's strength changes of the trial seldom changes the image
        const double rounded = std::exp2(0.5 * std::round(std::log2(square)));
        return float(std::clamp(rounded, min_gain, largest_gain));
    }
};

/// The samples of one pixel.
class Trial {
  public:
    /// rays: so far, of which `of_sample` are those of the sample.
    void add(uint64_t sample,
             const film::SampleRadiance& radiance,
             const Tails& tails,
             uint64_t rays,
             uint64_t of_sample) {
        if (radiance.is_bad()) return;
        const Rgb total = radiance.radiance();
        for (size_t c = 0; c < 3; ++c)
            runs_[sample * 2 / trial_samples][c] += double(total[int(c)]);
        // A sample costs something beside its rays
        cost_ += 1.0 + double(of_sample);
        for (const Tails::Chance& chance : tails.chances()) {
            if (!(chance.carried > 0.0)) continue;
            costs_[chance.index] += chance.carried * double(rays - chance.rays_before);
            for (size_t c = 0; c < 3; ++c) {
                const double tail = tails.total()[c] - chance.before[c];
                squares_[chance.index][c] += tail * tail / chance.carried;
            }
        }
    }

    Sums sums() const {
        Sums out;
        constexpr double samples = double(trial_samples);
        for (size_t c = 0; c < 3; ++c) {
            const double mean = (runs_[0][c] + runs_[1][c]) / samples;
            const double norm = mean * mean + 0.01;
            const double difference = (runs_[0][c] - runs_[1][c]) / (samples / 2);
            out.variance += difference * difference / 2 * (samples / 2) / norm;
            for (size_t i = 0; i < RouletteGains::count; ++i)
                out.tails[i] += squares_[i][c] / norm / samples;
        }
        for (size_t i = 0; i < RouletteGains::count; ++i) out.costs[i] = costs_[i] / samples;
        out.cost = cost_ / samples;
        return out;
    }

  private:
    std::array<Squares, 2> runs_ = {};
    std::array<Squares, RouletteGains::count> squares_ = {};
    std::array<double, RouletteGains::count> costs_ = {};
    double cost_ = 0;
};

}  // namespace

RouletteTrial try_roulette(const World& world,
                           const PathTracerOptions& options,
                           const std::atomic<bool>* stop) {
    RouletteTrial out;
    const auto start = std::chrono::steady_clock::now();
    PathTracerOptions trial_options = options;
    trial_options.seed = hash_combine(options.seed, trial_seed_salt);
    trial_options.roulette = nullptr;
    trial_options.branches = nullptr;
    const film::LayerSet layers = trial_layers(world.scene);
    const PathTracer tracer(world, layers, trial_options);

    // Every row sums its own pixels, so that the result does not depend on the threads
    const auto& settings = world.scene.settings;
    const auto tried = [](int size) {
        return std::min((size + cell_size - 1) / cell_size, max_to_a_side);
    };
    const int columns = tried(settings.width), rows = tried(settings.height);
    std::vector<Sums> sums{size_t(rows)};
    std::vector<RayCounts> counts{size_t(rows)};
    const auto is_stopped = [stop] { return stop && stop->load(std::memory_order_relaxed); };
    parallel_for(size_t(rows), [&](size_t row) {
        film::SampleRadiance radiance(layers);
        for (int column = 0; column < columns && !is_stopped(); ++column) {
            const int x = int((2 * int64_t(column) + 1) * settings.width / (2 * columns));
            const int y = int((2 * int64_t(row) + 1) * settings.height / (2 * rows));
            Trial trial;
            for (uint64_t s = 0; s < trial_samples; ++s) {
                radiance.clear();
                RayCounts& rays = counts[row];
                const uint64_t before = rays.total();
                Tails tails(rays);
                tracer.trace(x, y, s, radiance, rays, &tails);
                trial.add(s, radiance, tails, rays.total(), rays.total() - before);
            }
            sums[row] += trial.sums();
        }
    });
    Sums all;
    for (const Sums& s : sums) all += s;
    for (const RayCounts& c : counts) out.rays += c;
    if (!is_stopped()) {
        for (size_t i = 0; i < RouletteGains::count; ++i) out.gains.gains[i] = all.gain(i);
    }
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::integrator
