// SPDX-License-Identifier: Apache-2.0
#include "integrator/bounce_trial.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

namespace velatura::integrator {
namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x626f756e63657374ull;

constexpr uint64_t trial_samples = 8;
constexpr int max_to_a_side = 64;  // pixels that are tried

/// The light of one path, bounce by bounce.
class Deposits final : public PathObserver {
  public:
    explicit Deposits(size_t bounces) : light_(bounces + 1) {}

    void on_hit(int, const geometry::SurfacePoint&, float, const Rgb&) override {}

    void on_deposit(int bounce, scene::GroupId, const Rgb& radiance, const char*) override {
        double& light = light_[std::min(size_t(bounce), light_.size() - 1)];
        for (int c = 0; c < 3; ++c) light += double(radiance[c]);
    }

    void on_end(int, const char*) override {}

    const std::vector<double>& light() const { return light_; }

  private:
    std::vector<double> light_;
};

}  // namespace

int BounceTrial::last_bounce(double share, int max) const {
    const double all = std::accumulate(shares.begin(), shares.end(), 0.0);
    if (!(all > 0)) return max;
    int last = std::min(1, max);
    for (int bounce = last + 1; bounce <= max && size_t(bounce) + 1 < shares.size(); ++bounce)
        if (shares[size_t(bounce)] >= share) last = bounce;
    return last;
}

BounceTrial try_bounces(const World& world,
                        const PathTracerOptions& options,
                        int bounces,
                        const std::atomic<bool>* stop) {
    BounceTrial out;
    const auto start = std::chrono::steady_clock::now();
    PathTracerOptions trial_options = options;
    trial_options.seed = hash_combine(options.seed, trial_seed_salt);
    trial_options.branches = nullptr;
    const film::LayerSet layers = trial_layers(world.scene);
    const PathTracer tracer(world, layers, trial_options);

    // Every row sums its own pixels, so that the result does not depend on the threads
    const auto& settings = world.scene.settings;
    const int columns = std::min(settings.width, max_to_a_side),
              rows = std::min(settings.height, max_to_a_side);
    std::vector<std::vector<double>> light(size_t(rows), std::vector<double>(size_t(bounces) + 2));
    std::vector<RayCounts> counts{size_t(rows)};
    const auto is_stopped = [stop] { return stop && stop->load(std::memory_order_relaxed); };
    parallel_for(size_t(rows), [&](size_t row) {
        film::SampleRadiance radiance(layers);
        for (int column = 0; column < columns && !is_stopped(); ++column) {
            const int x = int((2 * int64_t(column) + 1) * settings.width / (2 * columns));
            const int y = int((2 * int64_t(row) + 1) * settings.height / (2 * rows));
            for (uint64_t s = 0; s < trial_samples; ++s) {
                radiance.clear();
                Deposits deposits(size_t(bounces) + 1);
                tracer.trace(x, y, s, radiance, counts[row], &deposits);
                if (radiance.is_bad()) continue;
                for (size_t b = 0; b < light[row].size(); ++b) light[row][b] += deposits.light()[b];
            }
        }
    });
    for (const RayCounts& c : counts) out.rays += c;
    out.shares.assign(size_t(bounces) + 2, 0.0);
    if (!is_stopped()) {
        for (const std::vector<double>& row : light)
            for (size_t b = 0; b < row.size(); ++b) out.shares[b] += row[b];
        const double all = std::accumulate(out.shares.begin(), out.shares.end(), 0.0);
        if (all > 0)
            for (double& share : out.shares) share /= all;
    }
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

std::string text_of(const BounceTrial& trial, int last_bounce) {
    std::string shares;
    for (size_t b = 0; b + 1 < trial.shares.size(); ++b)
        shares += fmt::format("b{} {:.2g} %, ", b, 100 * trial.shares[b]);
    return fmt::format(
        "b0 to b{} are stored as layers, later bounces in tail; shares of the light: {}tail {:.2g} "
        "%",
        last_bounce, shares, 100 * trial.shares.back());
}

}  // namespace velatura::integrator
