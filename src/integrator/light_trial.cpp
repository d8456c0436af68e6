// SPDX-License-Identifier: Apache-2.0
#include "integrator/light_trial.h"

#include "base/hash.h"
#include "base/tasks.h"
#include "integrator/path_tracer.h"
#include "integrator/trial_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace velatura::integrator {

namespace {

/// Keeps the random numbers of the trial apart from those of the render.
constexpr uint64_t trial_seed_salt = 0x6c69676874747279ull;

constexpr int min_cell = 8;        // pixels to a side
constexpr int max_to_a_side = 64;  // cells
constexpr uint64_t trial_samples = 16;
constexpr uint64_t photons_per_cell = 32;
constexpr uint64_t chunk_size = 1024;  // photons of a task
constexpr double min_emission = 1.0 / 16, max_emission = 1.0;
/// Light tracing must promise so much.
constexpr double min_gain = 1.02;
/// Of lights without extent, which camera paths cannot find.
constexpr double max_path_value = 1e12;
/// Caustics of less than this share of the image's light are left to paths.
constexpr double min_share = 1e-3;
/// Rays that a sample and a photon cost beside those that they trace.
constexpr double sample_overhead = 1.0, photon_overhead = 0.5;

/// Cells over the image.
struct Grid {
    explicit Grid(const scene::RenderSettings& s)
        : width(s.width),
          height(s.height),
          columns(std::clamp(s.width / min_cell, 1, max_to_a_side)),
          rows(std::clamp(s.height / min_cell, 1, max_to_a_side)) {}

    size_t count() const { return size_t(columns) * size_t(rows); }

    /// A pixel of the cell.
    int x(int column) const { return int((2 * int64_t(column) + 1) * width / (2 * columns)); }

    int y(int row) const { return int((2 * int64_t(row) + 1) * height / (2 * rows)); }

    /// False: the film point is outside of the image.
    bool find(const Vec2& film_point, size_t& cell) const {
        const double u = double(film_point.x) / width, v = double(film_point.y) / height;
        if (!(u >= 0.0 && u < 1.0 && v >= 0.0 && v < 1.0)) return false;
        cell = size_t(v * rows) * size_t(columns) + size_t(u * columns);
        return true;
    }

    double pixels_per_cell() const { return double(width) * double(height) / double(count()); }

    int width, height, columns, rows;
};

/// What camera paths bring to the pixel of a cell; luminances of one sample.
struct Cell {
    double mean = 0, variance = 0;
};

/// Of a squared error where the image is so bright.
double error_weight(double luminance) {
    return 1.0 / (luminance * luminance + 0.01);
}

class Trial {
  public:
    Trial(const World& world, const PathTracerOptions& options, const std::atomic<bool>* stop)
        : world_(world), options_(options), grid_(world.scene.settings), stop_(stop) {
        options_.seed = hash_combine(options.seed, trial_seed_salt);
        options_.branches = nullptr;
        layers_ = trial_layers(world.scene);
    }

    bool is_stopped() const { return stop_ && stop_->load(std::memory_order_relaxed); }

    void trace_paths() {
        cells_.resize(grid_.count());
        const PathTracer tracer(world_, layers_, options_);
        std::vector<RayCounts> counts{size_t(grid_.rows)};
        parallel_for(counts.size(), [&](size_t row) {
            film::SampleRadiance radiance(layers_);
            for (int column = 0; column < grid_.columns && !is_stopped(); ++column)
                trace_cell(tracer, column, int(row), radiance, counts[row]);
        });
        for (const RayCounts& c : counts) path_rays_ += c;
    }

    /// Photons of a round. Returns: the error that each causes.
    std::vector<sampling::KdWarp::Sample> trace_photons(const LightEmission& emission,
                                                        uint64_t round) {
        light_.assign(grid_.count(), {});
        PathTracerOptions options = options_;
        options.seed = hash_combine(options_.seed, round);
        const LightTracer tracer(world_, layers_, options, emission);
        const uint64_t photons = photon_count();
        const size_t chunks = size_t((photons + chunk_size - 1) / chunk_size);
        std::vector<Round> rounds(chunks);
        parallel_for(chunks, [&](size_t i) {
            if (is_stopped()) return;
            const uint64_t first = i * chunk_size;
            trace_chunk(tracer, first, std::min(first + chunk_size, photons), rounds[i]);
        });
        // In the order of the photons, so that the result does not depend on the threads
        light_rays_ = {};
        for (const Round& r : rounds) {
            light_rays_ += r.rays;
            for (const Event& e : r.events) {
                light_[e.cell].sum += e.value;
                light_[e.cell].sum2 += e.value * e.value;
                light_[e.cell].by_paths += e.value * e.path_value;
            }
        }
        std::vector<sampling::KdWarp::Sample> begun;
        begun.reserve(photons);
        for (const Round& r : rounds) {
            const size_t first = begun.size();
            begun.insert(begun.end(), r.begun.begin(), r.begun.end());
            for (const Event& e : r.events) {
                sampling::KdWarp::Sample& sample = begun[first + e.photon];
                const double value = e.value * sample.density;
                sample.square += value * value * error_weight(mean_luminance(e.cell));
            }
        }
        return begun;
    }

    LightTrial result(LightEmission emission) const {
        LightTrial out;
        const double pixels = double(grid_.width) * double(grid_.height), n = double(grid_.count()),
                     photons = double(photon_count());
        const double filter_square = square_of_filter();
        double light = 0, all_light = 0;
        for (size_t i = 0; i < cells_.size(); ++i) {
            const Cell& cell = cells_[i];
            const double mean = per_pixel(light_[i].sum), all = mean_luminance(i);
            const double weight = error_weight(all) / n;
            out.other_error += cell.variance * weight;
            out.path_error += per_pixel(light_[i].by_paths) * weight;
            out.light_error += filter_square * per_pixel(light_[i].sum2) / pixels * weight;
            light += mean;
            all_light += all;
        }

        out.rays = path_rays_;
        out.rays += light_rays_;

        const double path_cost =
                         sample_overhead + double(path_rays_.total()) / double(path_rays_.paths),
                     light_cost = photon_overhead + double(light_rays_.total()) / photons;
        const double best =
            std::sqrt(out.light_error * path_cost / std::max(1e-12, out.other_error * light_cost));
        emission.photons_per_pixel = std::clamp(best, min_emission, max_emission);
        const double with = (out.other_error + out.light_error / emission.photons_per_pixel) *
                            (path_cost + emission.photons_per_pixel * light_cost),
                     without = (out.other_error + out.path_error) * path_cost;
        out.is_used = light > min_share * all_light && with * min_gain < without;
        out.emission = std::move(emission);
        return out;
    }

  private:
    /// Light of a cell.
    struct Event {
        size_t cell = 0;
        size_t photon = 0;  ///< of the task
        double value = 0, path_value = 0;
    };

    struct Round {
        std::vector<Event> events;
        std::vector<sampling::KdWarp::Sample> begun;  // one of each photon
        RayCounts rays;
    };

    struct LightSums {
        double sum = 0, sum2 = 0;
        double by_paths = 0;  ///< second moment of camera paths that find the same light
    };

    /// Of a sum over photons.
    double per_pixel(double sum) const {
        return sum / double(photon_count()) / grid_.pixels_per_cell();
    }

    /// Of camera paths and photons.
    double mean_luminance(size_t cell) const {
        return cells_[cell].mean + per_pixel(light_[cell].sum);
    }

    uint64_t photon_count() const { return photons_per_cell * grid_.count(); }

    void trace_cell(const PathTracer& tracer,
                    int column,
                    int row,
                    film::SampleRadiance& radiance,
                    RayCounts& counts) {
        double sum = 0, sum2 = 0;
        for (uint64_t s = 0; s < trial_samples; ++s) {
            radiance.clear();
            tracer.trace(grid_.x(column), grid_.y(row), s, radiance, counts);
            if (radiance.is_bad()) continue;
            const double light = double(luminance(radiance.radiance()));
            sum += light;
            sum2 += light * light;
        }
        constexpr double n = double(trial_samples);
        cells_[size_t(row) * size_t(grid_.columns) + size_t(column)] = {
            sum / n, std::max(0.0, sum2 - sum * sum / n) / (n - 1.0)};
    }

    void trace_chunk(const LightTracer& tracer, uint64_t first, uint64_t end, Round& out) const {
        const film::Window image{0, 0, grid_.width, grid_.height};
        Splats splats;
        for (uint64_t i = first; i < end; ++i) {
            splats.splats.clear();
            const LightTracer::Beginning begun = tracer.trace(0, i, image, 0.0f, splats, out.rays);
            for (const Splat& s : splats.splats) {
                size_t cell = 0;
                const double value = double(luminance(s.radiance));
                if (!std::isfinite(value) || !std::isfinite(s.path_value) ||
                    !grid_.find(s.film_point, cell))
                    continue;
                out.events.push_back({cell, out.begun.size(), value,
                                      std::min(double(s.path_value), max_path_value)});
            }
            out.begun.push_back({begun.u, begun.density, 0.0});
        }
    }

    /// ∫ filter² over the plane.
    double square_of_filter() const {
        const sampling::PixelFilter filter(options_.filter);
        constexpr int steps = 32;
        double sum = 0;
        const double step = 2.0 * double(filter.radius()) / steps;
        for (int y = 0; y < steps; ++y)
            for (int x = 0; x < steps; ++x) {
                const double f = filter.evaluate((x + 0.5) * step - double(filter.radius()),
                                                 (y + 0.5) * step - double(filter.radius()));
                sum += f * f * step * step;
            }
        return sum;
    }

    const World& world_;
    PathTracerOptions options_;
    Grid grid_;
    const std::atomic<bool>* stop_;
    film::LayerSet layers_;
    std::vector<Cell> cells_;
    std::vector<LightSums> light_;  // [cell]
    RayCounts path_rays_, light_rays_;
};

/// What both rounds teach; each has as many photons, and the first was uniform.
sampling::KdWarp learned(std::vector<sampling::KdWarp::Sample> uniform,
                         const std::vector<sampling::KdWarp::Sample>& warped,
                         const sampling::KdWarp& warp) {
    uniform.insert(uniform.end(), warped.begin(), warped.end());
    for (sampling::KdWarp::Sample& s : uniform) s.density = 0.5 * (1.0 + warp.density(s.u));
    return sampling::KdWarp(uniform);
}

}  // namespace

std::string text_of(const LightTrial& trial) {
    return fmt::format("caustics by light tracing, {:.2g} photons per pixel and sample",
                       trial.emission.photons_per_pixel);
}

LightTrial try_light_tracing(const World& world,
                             const PathTracerOptions& options,
                             const std::atomic<bool>* stop) {
    const auto start = std::chrono::steady_clock::now();
    Trial trial(world, options, stop);
    LightTrial out;
    trial.trace_paths();
    const std::vector<sampling::KdWarp::Sample> uniform = trial.trace_photons({}, 0);
    // Who stops it does not wait for tables that nobody reads
    if (trial.is_stopped()) return out;
    LightEmission emission{sampling::KdWarp(uniform)};
    const std::vector<sampling::KdWarp::Sample> warped = trial.trace_photons(emission, 1);
    if (trial.is_stopped()) return out;
    emission.warp = learned(uniform, warped, emission.warp);
    out = trial.result(std::move(emission));
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return out;
}

}  // namespace velatura::integrator
