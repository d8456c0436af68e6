// SPDX-License-Identifier: Apache-2.0
#include "integrator/schedule.h"

#include "base/tasks.h"
#include "integrator/light_image.h"
#include "integrator/render_progress.h"
#include "scene/effect_calls.h"
#include "statistics/image_change.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

namespace velatura::integrator {

namespace {

/// Pixel rectangles of whole film tiles, so that no two tasks touch one film tile.
std::vector<film::Window> make_tiles(const film::Window& w, int tile_size) {
    const int unit = film::Film::tile_size;
    const int size = std::max(1, (tile_size + unit - 1) / unit) * unit;
    std::vector<film::Window> tiles;
    for (int y = w.y0; y < w.y1; y += size) {
        for (int x = w.x0; x < w.x1; x += size) {
            tiles.push_back({x, y, std::min(x + size, w.x1), std::min(y + size, w.y1)});
        }
    }
    return tiles;
}

class Runner {
  public:
    Runner(film::Film& film,
           const RenderOptions& options,
           const SampleFunction& sample,
           const RenderCallbacks& callbacks,
           const TopUpCounts* top_up,
           const LightTracer* light)
        : film_(film),
          sample_(sample),
          callbacks_(callbacks),
          tiles_(make_tiles(film.window(), options.tile_size)),
          progress_(film, options, callbacks),
          first_sample_(options.first_sample),
          end_sample_(options.end_sample),
          top_up_(top_up) {
        if (light) light_.emplace(*light, film.window());
        if (top_up) {
            // Only which passes of light tracing a sample gets still goes by the rates
            rates_ = SampleRates::kept_in(film).value_or(SampleRates());
            expect_samples();
        }
        if (top_up || !options.adaptive || options.end_sample <= pilot_samples) return;
        if (const std::optional<SampleRates> kept = SampleRates::kept_in(film)) {
            rates_ = *kept;
            expect_samples();
            return;
        }
        pilot_.emplace(film.window());
        double again = 0;
        for_each_pixel([&](int x, int y) {
            again += double(std::min(next_sample(x, y, options.first_sample), pilot_samples));
        });
        progress_.set_pilot_samples(again);
    }

    bool is_stopped() const {
        const auto is_set = [](const std::atomic<bool>* flag) {
            return flag && flag->load(std::memory_order_relaxed);
        };
        return is_set(callbacks_.stop) || is_set(callbacks_.give_up);
    }

    RenderProgress& progress() { return progress_; }

    /// What the image says of its error when it has the samples at the indices below `end`;
    /// nothing unless that is a power of two.
    std::optional<statistics::ErrorObservation> observe(const film::NoiseEstimate& noise,
                                                        uint64_t end) const {
        // Of two samples the change says little, and costs as much as that of many
        if (top_up_ || !noise.is_known || !std::has_single_bit(end) || end < 4) return std::nullopt;
        const std::optional<statistics::RelativeError> change =
            statistics::image_change(film_.sums());
        if (!change) return std::nullopt;
        return statistics::ErrorObservation{noise.samples_min, noise.samples_max,
                                            noise.samples_mean, progress_.elapsed_s(), *change};
    }

    /// True if the film came with all samples at the indices below `end`.
    bool has_all(uint64_t end) const {
        if (pilot_ && end > pilot_samples) return false;
        const film::Window& w = film_.window();
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                if (film_.next_sample(x, y) < count(x, y, end)) return false;
            }
        }
        return true;
    }

    /// True if the film came with samples at indices from `end` on.
    bool has_more(uint64_t end) const {
        const film::Window& w = film_.window();
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                if (film_.next_sample(x, y) > count(x, y, end)) return true;
            }
        }
        return false;
    }

    /// Samples of every pixel at the indices [first, end), which do not lie on both sides of the
    /// pilot's end; what a pixel has of them already is left out. Returns false when stopped
    /// inside.
    bool run(uint64_t first, uint64_t end) {
        if (pilot_ && first >= pilot_samples) {
            // What the film had before or does not want is traced for the pilot alone
            if (!for_each_tile([&](const film::Window& tile) { return watch_tile(tile); }))
                return false;
            rates_ = SampleRates(*pilot_);
            rates_.keep_in(film_);
            pilot_.reset();
            expect_samples();
        }
        if (!light_)
            return for_each_tile(
                [&](const film::Window& tile) { return run_tile(tile, first, end, all_passes); });
        return run_with_light(first, end);
    }

  private:
    static constexpr uint64_t all_passes = std::numeric_limits<uint64_t>::max();

    /// What a thread fills tile after tile; large where there are thousands of layers.
    struct ThreadScratch {
        explicit ThreadScratch(const film::LayerSet& layers)
            : accumulator(layers), radiance(layers) {}

        film::PixelAccumulator accumulator;
        film::SampleRadiance radiance;
    };

    /// A scratch for the time of a tile. One that a stop left in the middle of a pixel is not used
    /// again.
    class Lease {
      public:
        explicit Lease(Runner& runner) : runner_(runner) {
            const std::lock_guard lock(runner.rooms_mutex_);
            // Space for all of them to come back: a destructor must not look for memory
            runner.scratches_.reserve(runner.scratches_.size() + runner.leases_ + 1);
            ++runner.leases_;
            if (!runner.scratches_.empty()) {
                scratch_ = std::move(runner.scratches_.back());
                runner.scratches_.pop_back();
            }
        }

        ~Lease() {
            const std::lock_guard lock(runner_.rooms_mutex_);
            --runner_.leases_;
            if (scratch_ && !runner_.is_stopped())
                runner_.scratches_.push_back(std::move(scratch_));
        }

        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;

        ThreadScratch& scratch() {
            if (!scratch_) scratch_ = std::make_unique<ThreadScratch>(runner_.film_.layer_set());
            return *scratch_;
        }

      private:
        Runner& runner_;
        std::unique_ptr<ThreadScratch> scratch_;
    };

    template <class Body>
    void for_each_pixel(const Body& body) const {
        const film::Window& w = film_.window();
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x) body(x, y);
    }

    /// Once it is known how many samples each pixel gets.
    void expect_samples() {
        double all = 0;
        for_each_pixel([&](int x, int y) {
            const accumulate::PixelRecord& record = film_.sums().record(x, y);
            const uint64_t first =
                record.first == record.end ? next_sample(x, y, first_sample_) : record.first;
            all += double(std::max(count(x, y, end_sample_), record.end) - first);
        });
        progress_.set_samples(all);
    }

    bool for_each_tile(const std::function<bool(const film::Window&)>& body) {
        std::atomic<bool> complete = true;
        parallel_for(tiles_.size(), [&](size_t i) {
            if (!body(tiles_[i])) complete = false;
        });
        return complete;
    }

    /// run(), passes of light tracing and the samples that they are for in turn.
    bool run_with_light(uint64_t first, uint64_t end) {
        uint64_t begin_pass = all_passes, end_pass = 0;
        for_each_pixel([&](int x, int y) {
            const uint64_t pixel_first = next_sample(x, y, first), pixel_end = count(x, y, end);
            if (pixel_first >= pixel_end) return;
            begin_pass = std::min(begin_pass, rates_.light_passes(x, y, pixel_first).begin);
            end_pass = std::max(end_pass, rates_.light_passes(x, y, pixel_end - 1).end);
        });
        for (uint64_t pass = begin_pass, next = 0; pass < end_pass; pass = next) {
            next = light_->end_of_run(pass, end_pass);
            progress_.add(0, 0, light_->trace(pass, next, [this] { return is_stopped(); }));
            if (is_stopped()) return false;
            if (!for_each_tile(
                    [&](const film::Window& tile) { return run_tile(tile, first, end, next); }))
                return false;
        }
        return true;
    }

    /// Samples at the indices [first, end) that need no pass of light tracing from end_pass on.
    bool run_tile(const film::Window& tile, uint64_t first, uint64_t end, uint64_t end_pass) {
        Lease lease(*this);
        auto& [accumulator, radiance] = lease.scratch();
        for (int y = tile.y0; y < tile.y1; ++y) {
            RayCounts counts;
            uint64_t done = 0, watched = 0;
            for (int x = tile.x0; x < tile.x1; ++x) {
                if (is_stopped()) return false;
                const uint64_t pixel_first = next_sample(x, y, first), pixel_end = count(x, y, end);
                if (pilot_)
                    watched +=
                        watch_pixel(x, y, std::min(pixel_first, pilot_samples), radiance, counts);
                film_.begin_pixel(accumulator, x, y, pixel_first);
                for (uint64_t s = pixel_first; s < pixel_end; ++s) {
                    LightPasses passes;
                    if (light_) {
                        passes = rates_.light_passes(x, y, s);
                        if (passes.end > end_pass) break;
                    }
                    trace(x, y, s, radiance, counts);
                    if (light_) light_->add(x, y, passes, radiance);
                    accumulator.add(radiance);
                }
                done += accumulator.next_sample() - pixel_first;
                film_.end_pixel(accumulator);
            }
            counts.effects += scene::take_effect_calls();
            progress_.add(double(done), double(watched), counts);
        }
        if (callbacks_.tile_done) callbacks_.tile_done(film_, tile);
        return true;
    }

    /// Samples of the pixel at an index of the render.
    uint64_t count(int x, int y, uint64_t index) const {
        return top_up_ ? top_up_->count(x, y, index) : rates_.count(x, y, index);
    }

    /// First sample that the pixel does not have of those from index `first` on.
    uint64_t next_sample(int x, int y, uint64_t first) const {
        const accumulate::PixelRecord& record = film_.sums().record(x, y);
        return record.first == record.end ? count(x, y, first) : record.end;
    }

    /// Pilot samples of a pixel up to `end` that the image has already or does not want. Returns:
    /// how many.
    uint64_t watch_pixel(
        int x, int y, uint64_t end, film::SampleRadiance& radiance, RayCounts& counts) {
        const uint64_t first = pilot_->next_sample(x, y);
        for (uint64_t s = first; s < end; ++s) trace(x, y, s, radiance, counts);
        return end > first ? end - first : 0;
    }

    /// The rest of the pilot's samples.
    bool watch_tile(const film::Window& tile) {
        Lease lease(*this);
        film::SampleRadiance& radiance = lease.scratch().radiance;
        for (int y = tile.y0; y < tile.y1; ++y) {
            RayCounts counts;
            uint64_t watched = 0;
            for (int x = tile.x0; x < tile.x1; ++x) {
                if (is_stopped()) return false;
                watched += watch_pixel(x, y, pilot_samples, radiance, counts);
            }
            counts.effects += scene::take_effect_calls();
            progress_.add(0, double(watched), counts);
        }
        return true;
    }

    void trace(int x, int y, uint64_t sample, film::SampleRadiance& radiance, RayCounts& counts) {
        const uint64_t rays = counts.total();
        radiance.clear();
        sample_(x, y, sample, radiance, counts);
        if (!pilot_) return;
        scene::count_call(scene::Effect::AdaptiveSampling);
        const Rgb value = radiance.is_bad() ? Rgb(0.0f) : radiance.light_seen() * radiance.weight;
        pilot_->add(x, y, value, counts.total() - rays);
    }

    film::Film& film_;
    const SampleFunction& sample_;
    const RenderCallbacks& callbacks_;
    std::vector<film::Window> tiles_;
    RenderProgress progress_;
    uint64_t first_sample_, end_sample_;
    std::optional<PilotNoise>
        pilot_;  ///< until the rates are known; none when sampling is not adaptive
    SampleRates rates_;
    std::optional<LightImage> light_;
    const TopUpCounts* top_up_;  ///< in place of the rates
    std::mutex rooms_mutex_;
    std::vector<std::unique_ptr<ThreadScratch>> scratches_;
    size_t leases_ = 0;
};

RenderResult run_tile_mode(Runner& runner, const RenderOptions& options) {
    RenderResult result;
    result.end_sample = options.end_sample;
    // The pilot decides what comes after it
    const uint64_t middle = std::clamp(pilot_samples, options.first_sample, options.end_sample);
    if (!runner.run(options.first_sample, middle) || !runner.run(middle, options.end_sample)) {
        result.reason = StopReason::Interrupted;
        result.is_uniform = false;
    }
    return result;
}

/// Adds what a pass showed to the curve, and shows what the curve says.
void follow_error(Runner& runner,
                  const RenderOptions& options,
                  const film::NoiseEstimate& noise,
                  uint64_t end,
                  statistics::ErrorCurve& curve) {
    if (const std::optional<statistics::ErrorObservation> seen = runner.observe(noise, end))
        curve.add(*seen);
    if (!noise.is_known) return;
    if (curve.is_empty()) {
        runner.progress().set_error(noise.error.value, !options.has_independent_halves,
                                    noise.error.is_lower, std::nullopt);
        return;
    }
    const double wanted =
        options.forecast_error > 0 ? options.forecast_error : options.target_error;
    std::optional<statistics::ErrorForecast> forecast;
    if (wanted > 0) forecast = curve.forecast(wanted);
    if (options.has_independent_halves) {
        runner.progress().set_error(noise.error.value, false,
                                    noise.error.is_lower || curve.is_lower(), forecast);
        return;
    }
    runner.progress().set_error(curve.error_at(noise.samples_mean).value,
                                options.has_dependent_changes, curve.is_lower(), forecast);
}

/// The noise of layers is looked at from so many samples on: what the first ones say of it is soon
/// forgotten.
constexpr uint64_t first_of_layers = 8;

constexpr uint64_t never = std::numeric_limits<uint64_t>::max();

/// Where a render that has the samples below `end`, the last ones that its curve knows of, is to
/// stop for its target: there, at some index before the next power of two, or not yet.
uint64_t target_end(const statistics::ErrorCurve& curve,
                    const RenderOptions& options,
                    uint64_t end) {
    // An image of few samples has not met what is rare
    if (options.target_error <= 0 || curve.is_empty() || end < pilot_samples) return never;
    if (options.needs_sure_target && curve.is_lower()) return never;
    const statistics::ErrorForecast f = curve.forecast(options.target_error);
    if (f.kind == statistics::ErrorForecast::Kind::Reached) return end;
    // How samples are placed is not known before the pilot's end
    const bool is_placing = options.adaptive && end <= pilot_samples;
    if (f.kind != statistics::ErrorForecast::Kind::Known || is_placing) return never;
    const double unit = double(end) / double(pilot_samples),
                 more = f.samples / curve.points().back().samples_mean - 1;
    const uint64_t stop = end + uint64_t(std::ceil(more * double(end) / unit) * unit);
    return stop < 2 * end ? stop : never;
}

RenderResult run_progressive_mode(film::Film& film,
                                  Runner& runner,
                                  const RenderOptions& options,
                                  const RenderCallbacks& callbacks) {
    RenderResult result;
    result.end_sample = options.first_sample;
    result.curve = options.curve;
    uint64_t longest = never;
    for (uint64_t end = 0; result.end_sample < options.end_sample; result.end_sample = end) {
        end = pass_end(result.end_sample, options.end_sample, longest);
        if (!runner.has_all(end)) break;
    }
    if (result.end_sample == options.end_sample) return result;
    if (result.curve.is_empty() && result.end_sample > 0 && !runner.has_more(result.end_sample))
        follow_error(runner, options, film.noise(), result.end_sample, result.curve);
    uint64_t stop_sample = target_end(result.curve, options, result.end_sample);
    if (stop_sample != never && runner.has_all(stop_sample) && !runner.has_more(stop_sample)) {
        result.end_sample = stop_sample;
        result.reason = StopReason::TargetError;
        return result;
    }
    statistics::LayerChanges layers(film.sums());
    double last_snapshot_s = 0;
    while (result.end_sample < options.end_sample) {
        const uint64_t end =
            std::min(stop_sample, pass_end(result.end_sample, options.end_sample, longest));
        const double pass_start_s = runner.progress().elapsed_s();
        if (result.end_sample >= first_of_layers) layers.keep(film.sums());
        if (!runner.run(result.end_sample, end)) {
            result.reason = StopReason::Interrupted;
            result.is_uniform = false;
            return result;
        }
        const uint64_t pass_samples = end - result.end_sample;
        result.end_sample = end;

        const film::NoiseEstimate noise = film.noise();
        follow_error(runner, options, noise, end, result.curve);
        if (std::has_single_bit(end)) {
            layers.observe(film.sums());
            result.layer_noise = layers.noise(result.curve.slope().value);
        }
        const double now_s = runner.progress().elapsed_s();
        const bool is_done = end == options.end_sample;
        if (std::has_single_bit(end)) stop_sample = target_end(result.curve, options, end);
        if (end == stop_sample && !is_done) {
            result.reason = StopReason::TargetError;
            return result;
        }
        if (options.time_budget_s > 0 && now_s >= options.time_budget_s && !is_done) {
            result.reason = StopReason::TimeBudget;
            return result;
        }
        const bool is_due = options.snapshot_interval_s > 0 &&
                            now_s - last_snapshot_s >= options.snapshot_interval_s;
        const bool is_wanted = callbacks.snapshot_requested && callbacks.snapshot_requested();
        if (callbacks.snapshot && !is_done && (is_due || is_wanted)) {
            callbacks.snapshot(film, result.curve);
            last_snapshot_s = runner.progress().elapsed_s();
        }

        // A pass must not outlast the wait for the next interim image or the rest of the time
        // budget
        double longest_s = std::numeric_limits<double>::infinity();
        if (options.snapshot_interval_s > 0) longest_s = options.snapshot_interval_s;
        if (options.time_budget_s > 0)
            longest_s = std::min(longest_s, options.time_budget_s - now_s);
        const double sample_s = (now_s - pass_start_s) / double(pass_samples);
        if (std::isfinite(longest_s) && sample_s > 0) {
            longest = std::bit_floor(uint64_t(std::clamp(longest_s / sample_s, 1.0, 1e18)));
        }
    }
    return result;
}

}  // namespace

uint64_t pass_end(uint64_t first, uint64_t end, uint64_t longest) {
    // The largest aligned power of two that starts here; from 0 on that gives 1, 1, 2, 4, 8 …
    uint64_t size = first == 0 ? 1 : first & (~first + 1);
    size = std::min(size, std::bit_floor(longest));
    return std::min(first + size, end);
}

uint64_t max_samples(const RenderOptions& options) {
    return options.adaptive ? SampleRates::max(options.end_sample) : options.end_sample;
}

RenderResult run_schedule(film::Film& film,
                          const RenderOptions& options,
                          const SampleFunction& sample,
                          const RenderCallbacks& callbacks,
                          const TopUpCounts* top_up,
                          const LightTracer* light) {
    Runner runner(film, options, sample, callbacks, top_up, light);
    RenderResult result = options.mode == RenderMode::Tile
                              ? run_tile_mode(runner, options)
                              : run_progressive_mode(film, runner, options, callbacks);
    result.has_more = runner.has_more(result.end_sample);
    result.seconds = runner.progress().elapsed_s();
    result.rays = runner.progress().rays();
    return result;
}

}  // namespace velatura::integrator
