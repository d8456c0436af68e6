// SPDX-License-Identifier: Apache-2.0
#include "integrator/truncation_trial.h"

#include "base/check.h"
#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

namespace velatura::integrator {
namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x7472756e63617465ull;

constexpr int64_t max_to_a_side = 512;  // pixels that are tried, as far apart as possible
constexpr int64_t min_paths = 1024;

/// Interleaved sets of pixels, whose differences show the noise.
constexpr size_t set_count = 16;

/// The light of one path, of all bounces and of those past the limit.
class Deposits final : public PathObserver {
  public:
    explicit Deposits(int max_depth) : max_depth_(max_depth) {}

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_deposit(int bounce, scene::GroupId, const Rgb& radiance, const char*) override {
        const double light = double(radiance[0]) + double(radiance[1]) + double(radiance[2]);
        all += light;
        if (bounce > max_depth_) late += light;
    }

    void on_end(int, const char*) override {}

    double all = 0, late = 0;

  private:
    const int max_depth_;
};

struct Light {
    double all = 0, late = 0;

    void add(const Light& other) {
        all += other.all;
        late += other.late;
    }

    double share() const { return all > 0 ? late / all : 0; }
};

using Sets = std::array<Light, set_count>;

/// Mean and interval of the share, from all sets and from all but one at a time.
void estimate(const Sets& sets, TruncationTrial& out) {
    Light all;
    for (const Light& set : sets) all.add(set);
    // The jackknife estimate of variance: Efron, Stein 1981
    double sum = 0, squares = 0;
    for (const Light& set : sets) {
        const double rest = Light{all.all - set.all, all.late - set.late}.share();
        sum += rest;
        squares += rest * rest;
    }
    // Student's t with set_count - 1 degrees of freedom
    constexpr double n = double(set_count), quantile = 2.131;
    const double deviation = std::sqrt(std::max(0.0, (squares - sum * sum / n) * (n - 1) / n));
    out.share = all.share();
    out.low = std::max(0.0, out.share - quantile * deviation);
    out.high = std::min(1.0, out.share + quantile * deviation);
    // Paths that were not met in n trials have a probability of 3 / n or less, with 95 % confidence
    if (all.late == 0)
        out.high = std::min(1.0, 3.0 / double(std::max<uint64_t>(out.rays.paths, 1)));
}

}  // namespace

TruncationTrial try_truncation(const World& world,
                               const PathTracerOptions& options,
                               const std::atomic<bool>* stop) {
    VELATURA_CHECK(options.max_depth > 0, "without a limit nothing is cut off");
    TruncationTrial out;
    const auto start = std::chrono::steady_clock::now();
    PathTracerOptions trial_options = options;
    trial_options.seed = hash_combine(options.seed, trial_seed_salt);
    trial_options.max_depth = 0;
    // Without the limit something has to end the paths
    if (options.estimator.roulette == Roulette::None)
        trial_options.estimator.roulette = Roulette::Throughput;
    trial_options.branches = nullptr;
    trial_options.caustics = nullptr;
    trial_options.caustic_paths = nullptr;
    const film::LayerSet layers = trial_layers(world.scene);
    const PathTracer tracer(world, layers, trial_options);

    // Every row sums its own pixels, so that the result does not depend on the threads
    const int64_t width = world.scene.settings.width, height = world.scene.settings.height;
    const int64_t columns = std::min(width, max_to_a_side), rows = std::min(height, max_to_a_side);
    const auto samples = uint64_t(std::max<int64_t>(min_paths / (columns * rows), 1));
    std::vector<Sets> light{size_t(rows)};
    std::vector<RayCounts> counts{size_t(rows)};
    parallel_for(size_t(rows), [&](size_t row) {
        film::SampleRadiance radiance(layers);
        for (int64_t column = 0; column < columns; ++column) {
            if (stop && stop->load(std::memory_order_relaxed)) return;
            const int x = int((2 * column + 1) * width / (2 * columns));
            const int y = int((2 * int64_t(row) + 1) * height / (2 * rows));
            Light& set = light[row][(size_t(column) + 5 * row) % set_count];
            for (uint64_t s = 0; s < samples; ++s) {
                radiance.clear();
                Deposits deposits(options.max_depth);
                tracer.trace(x, y, s, radiance, counts[row], &deposits);
                if (!radiance.is_bad()) set.add({deposits.all, deposits.late});
            }
        }
    });
    Sets sets;
    for (const Sets& row : light)
        for (size_t i = 0; i < set_count; ++i) sets[i].add(row[i]);
    for (const RayCounts& c : counts) out.rays += c;
    estimate(sets, out);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

std::string text_of(const TruncationTrial& trial) {
    return fmt::format(
        "light of longer paths is missing: about {:.2g} % of all light ({:.2g} to {:.2g}), "
        "measured by {} trial paths without the limit",
        100 * trial.share, 100 * trial.low, 100 * trial.high, trial.rays.paths);
}

}  // namespace velatura::integrator
