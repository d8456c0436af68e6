// SPDX-License-Identifier: Apache-2.0
#include "integrator/splitting_trial.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/trial_layers.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace velatura::integrator {

namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x6272616e63682121ull;

constexpr int cell_size = 8;  // pixels to a side, of which one is tried
constexpr uint64_t trial_samples = 16;
constexpr uint32_t trial_branches = 2;
constexpr size_t runs = 2;
constexpr int reach = 1;  // blocks to each side of a block that count for it
/// What twice as many branches must promise, as few trial paths promise now and then by chance, and
/// as low-discrepancy points make more of samples than of branches.
constexpr double min_gain = 1.15;

/// Relative squared errors of a pixel's mean, variance / (mean² + 0.01), and costs of a sample in
/// rays: of what comes before a path divides, and of one branch.
struct Parts {
    double prefix_error = 0, branch_error = 0;
    double prefix_cost = 0, branch_cost = 0;

    /// Proportional to 1 / efficiency.
    double inefficiency(uint32_t branches) const {
        // A difference of estimates may fall below zero by chance
        return (std::max(0.0, prefix_error) + branch_error / branches) *
               (prefix_cost + branches * branch_cost);
    }

    void operator+=(const Parts& o) {
        prefix_error += o.prefix_error;
        branch_error += o.branch_error;
        prefix_cost += o.prefix_cost;
        branch_cost += o.branch_cost;
    }
};

/// The samples of one pixel.
class Trial {
  public:
    void add(uint64_t sample, const film::SampleRadiance& radiance) {
        if (radiance.is_bad()) return;
        const size_t run = sample * runs / trial_samples;
        const Rgb total = radiance.radiance() * radiance.weight,
                  branches = radiance.branch_radiance() * radiance.weight;
        for (int c = 0; c < 3; ++c) {
            total_[run][c] += double(total[c]);
            branches_[run][c] += double(branches[c]);
        }
    }

    Parts parts(const RayCounts& counts) const {
        Parts parts;
        for (int c = 0; c < 3; ++c) {
            const double mean = (total_[0][c] + total_[1][c]) / double(trial_samples);
            const double norm = mean * mean + 0.01;
            const double branch_error = variance(branches_, c) / norm;
            // All that branches bring counts as different from one to the other
            parts.branch_error += branch_error * trial_branches;
            parts.prefix_error += variance(total_, c) / norm - branch_error;
        }
        if (!std::isfinite(parts.prefix_error) || !std::isfinite(parts.branch_error)) return {};
        // A sample costs something beside its rays
        parts.prefix_cost =
            1.0 + double(counts.total() - counts.in_branches) / double(trial_samples);
        parts.branch_cost = double(counts.in_branches) / double(trial_samples * trial_branches);
        return parts;
    }

  private:
    using Sums = double[runs][3];

    static double variance(const Sums& sums, int c) {
        const double difference =
            (sums[0][c] - sums[1][c]) / (double(trial_samples) / double(runs));
        return difference * difference / 2;
    }

    Sums total_ = {}, branches_ = {};
};

/// Cells or blocks over the image.
struct Grid {
    Grid(const scene::RenderSettings& settings, int size)
        : across((settings.width + size - 1) / size), high((settings.height + size - 1) / size) {}

    size_t count() const { return size_t(across) * size_t(high); }

    int across, high;
};

/// Some of the columns or rows of a grid: [begin, end).
struct Span {
    int begin, end;

    int count() const { return end - begin; }
};

/// Those of `count` blocks that hold pixels from begin to end; the nearest one where that is beside
/// the image.
Span blocks_of(int begin, int end, int count) {
    const auto block = [&](int pixel) {
        return std::clamp(pixel / SplittingMap::block_size, 0, count - 1);
    };
    return {block(begin), block(end - 1) + 1};
}

class Trials {
  public:
    Trials(const World& world,
           const PathTracerOptions& options,
           const film::Window& window,
           const std::atomic<bool>* stop)
        : settings_(world.scene.settings),
          cells_(settings_, cell_size),
          two_(trial_branches),
          stop_(stop) {
        const Grid blocks(settings_, SplittingMap::block_size);
        columns_ = blocks_of(window.x0, window.x1, blocks.across);
        rows_ = blocks_of(window.y0, window.y1, blocks.high);
        PathTracerOptions trial_options = options;
        trial_options.seed = seed_ = hash_combine(options.seed, trial_seed_salt);
        trial_options.branches = &two_;
        const film::LayerSet layers = trial_layers(world.scene);
        trace(PathTracer(world, layers, trial_options), layers);
    }

    bool is_stopped() const { return stop_ && stop_->load(std::memory_order_relaxed); }

    RayCounts rays() const {
        RayCounts sum;
        for (const RayCounts& counts : counts_) sum += counts;
        return sum;
    }

    SplittingMap map() const {
        std::vector<uint8_t> counts;
        for (int y = rows_.begin; y < rows_.end; ++y) {
            for (int x = columns_.begin; x < columns_.end; ++x)
                counts.push_back(uint8_t(best(around(x, y))));
        }
        return {columns_.count(), std::move(counts), columns_.begin, rows_.begin};
    }

  private:
    void trace(const PathTracer& tracer, const film::LayerSet& layers) {
        parts_.resize(cells_.count());
        const Span tried_columns = cells_around(columns_, cells_.across),
                   tried_rows = cells_around(rows_, cells_.high);
        counts_.resize(size_t(tried_rows.count()));
        parallel_for(counts_.size(), [&](size_t i) {
            const size_t row = size_t(tried_rows.begin) + i;
            film::SampleRadiance radiance(layers);
            for (int column = tried_columns.begin; column < tried_columns.end && !is_stopped();
                 ++column) {
                const size_t cell = row * size_t(cells_.across) + size_t(column);
                const uint64_t place = hash_combine(seed_, cell);
                const int x =
                    std::min(column * cell_size + int(place % cell_size), settings_.width - 1);
                const int y = std::min(int(row) * cell_size + int(place / cell_size % cell_size),
                                       settings_.height - 1);
                Trial trial;
                RayCounts counts;
                for (uint64_t s = 0; s < trial_samples; ++s) {
                    radiance.clear();
                    tracer.trace(x, y, s, radiance, counts);
                    trial.add(s, radiance);
                }
                parts_[cell] = trial.parts(counts);
                counts_[i] += counts;
            }
        });
    }

    /// Of `count` columns or rows of cells those of blocks and of the blocks around them.
    static Span cells_around(const Span& blocks, int count) {
        constexpr int per_block = SplittingMap::block_size / cell_size;
        return {std::max(0, (blocks.begin - reach) * per_block),
                std::min(count, (blocks.end + reach) * per_block)};
    }

    /// Sum over the cells of a block and of those around it.
    Parts around(int block_x, int block_y) const {
        const Span columns = cells_around({block_x, block_x + 1}, cells_.across),
                   rows = cells_around({block_y, block_y + 1}, cells_.high);
        Parts sum;
        for (int y = rows.begin; y < rows.end; ++y) {
            for (int x = columns.begin; x < columns.end; ++x)
                sum += parts_[size_t(y) * size_t(cells_.across) + size_t(x)];
        }
        return sum;
    }

    static uint32_t best(const Parts& parts) {
        uint32_t best = 1;
        for (uint32_t n = 2; n <= SplittingMap::max; n *= 2) {
            // Written so that no noise at all is no gain
            if (!(min_gain * parts.inefficiency(n) < parts.inefficiency(best))) break;
            best = n;
        }
        return best;
    }

    const scene::RenderSettings& settings_;
    Grid cells_;
    Span columns_ = {}, rows_ = {};  // of the blocks that are wanted
    SplittingMap two_;
    const std::atomic<bool>* stop_;
    uint64_t seed_ = 0;
    std::vector<Parts> parts_;       // [cell]
    std::vector<RayCounts> counts_;  // [row of cells that are tried]
};

}  // namespace

SplittingTrial try_splitting(const World& world,
                             const PathTracerOptions& options,
                             const film::Window& window,
                             const std::atomic<bool>* stop) {
    SplittingTrial out;
    // Chains of mirrors never divide
    if (options.estimator.specular_chains_only) return out;
    const auto start = std::chrono::steady_clock::now();
    const Trials trials(world, options, window, stop);
    out.rays = trials.rays();
    if (!trials.is_stopped()) out.map = trials.map();
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::integrator
