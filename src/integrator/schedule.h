// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/light_tracer.h"
#include "integrator/ray_counts.h"
#include "integrator/render_options.h"
#include "integrator/sample_placement.h"
#include "statistics/error_curve.h"
#include "statistics/layer_changes.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace velatura::integrator {

/// Traces sample `sample` of pixel (x, y) into `out`, which is cleared.
using SampleFunction = std::function<void(
    int x, int y, uint64_t sample, film::SampleRadiance& out, RayCounts& counts)>;

/// How far a render is. `error` is the relative standard error of the image so far, where it is
/// known, or more than that.
struct RenderState {
    double fraction = 0;
    double samples_per_pixel = 0;
    double elapsed_s = 0;
    std::optional<double> left_s;
    std::optional<double> error;
    bool is_upper_error = false, is_lower_error = false;
    std::optional<statistics::ErrorForecast>
        forecast;  ///< of RenderOptions::forecast_error or target_error
    RayCounts rays;
};

struct RenderCallbacks {
    /// Called often, from any rendering thread but one at a time.
    std::function<void(const RenderState&)> progress;
    /// Called by the thread that a tile belongs to, after it got samples.
    std::function<void(const film::Film&, const film::Window&)> tile_done;
    /// Called between passes with every pixel at the same sample index, when an interim image is
    /// due; with what is known of its error.
    std::function<void(const film::Film&, const statistics::ErrorCurve&)> snapshot;
    /// Asked between passes: true = an interim image is wanted now, whatever the interval.
    std::function<bool()> snapshot_requested;
    /// Set to stop, each: no further sample is started.
    const std::atomic<bool>* stop = nullptr;
    const std::atomic<bool>* give_up = nullptr;
};

enum class StopReason : uint8_t { Complete, TimeBudget, TargetError, Interrupted };

struct RenderResult {
    StopReason reason = StopReason::Complete;
    uint64_t end_sample = 0;  ///< every pixel has what it gets of the sample indices [first_sample,
                              ///< end_sample), see SampleRates
    bool is_uniform =
        true;               ///< false: interrupted inside a pass; pixels differ in how far they are
    bool has_more = false;  ///< the film came with samples at indices from end_sample on
    double seconds = 0;
    RayCounts rays;
    statistics::ErrorCurve curve;  ///< progressive, at powers of two
    std::vector<statistics::LayerNoise>
        layer_noise;  ///< progressive, once all pixels looked at have doubled
};

/// Sample ranges of the passes of a progressive render that starts at `first`: [0,1) [1,2) [2,4)
/// [4,8) …, each aligned to its power of two and no longer than `longest`. Returns: the end of the
/// pass that starts at `first`.
uint64_t pass_end(uint64_t first, uint64_t end, uint64_t longest);

/// No pixel of a render gets samples of this index or above.
uint64_t max_samples(const RenderOptions& options);

/// Runs the sample function for all samples of all pixels of the film's window, in parallel, tile
/// by tile or pass by pass. The film's content depends on neither, nor on how much of it the film
/// had already: samples that are there are not traced again, whatever the run before stopped at,
/// but for the first few where they place the others. `top_up`: counts that take the place of the
/// rates, at the indices from 0 to its steps, which are options.end_sample. `light`: adds its
/// splats to the samples.
RenderResult run_schedule(film::Film& film,
                          const RenderOptions& options,
                          const SampleFunction& sample,
                          const RenderCallbacks& callbacks,
                          const TopUpCounts* top_up = nullptr,
                          const LightTracer* light = nullptr);

}  // namespace velatura::integrator
