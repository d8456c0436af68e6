// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/ray_counts.h"
#include "integrator/render_options.h"
#include "integrator/schedule.h"
#include "integrator/work_rate.h"
#include "statistics/error_curve.h"

#include <chrono>
#include <mutex>
#include <optional>

namespace velatura::integrator {

/// Work of one render: counts what is done and tells the callback.
class RenderProgress {
  public:
    RenderProgress(const film::Film& film,
                   const RenderOptions& options,
                   const RenderCallbacks& callbacks);

    /// Pilot samples that come on top of those of the film.
    void set_pilot_samples(double count) { pilot_total_ = count; }

    /// All samples that the film will have, those that it came with included.
    void set_samples(double count) {
        std::lock_guard lock(mutex_);
        samples_total_ = count;
    }

    /// Counts pixel samples of the film, those that the pilot alone traced, and rays; reports.
    void add(double samples, double pilot, const RayCounts& counts);

    /// Of the image so far, relative; see RenderState. Reports.
    void set_error(double error,
                   bool is_upper,
                   bool is_lower,
                   std::optional<statistics::ErrorForecast> forecast);

    /// Since the beginning [s].
    double elapsed_s() const;

    RayCounts rays() const {
        std::lock_guard lock(mutex_);
        return rays_;
    }

  private:
    using Clock = std::chrono::steady_clock;

    /// Pixel samples that this run traced.
    double work() const { return samples_ - samples_before_ + pilot_done_; }

    /// Pixel samples of this run that end it, as far as that is known.
    std::optional<double> expected_work() const;

    void report();

    const RenderCallbacks& callbacks_;
    RenderOptions options_;
    mutable std::mutex mutex_;
    double pixels_, samples_total_;
    double samples_ = 0;         ///< of the film
    double samples_before_ = 0;  ///< that it came with
    double pilot_total_ = 0, pilot_done_ = 0;
    double fraction_ = 0;  ///< never goes back
    WorkRate rate_;
    Clock::time_point start_;
    std::optional<double> error_;
    bool is_upper_error_ = false, is_lower_error_ = false;
    std::optional<statistics::ErrorForecast> forecast_;
    RayCounts rays_;
};

}  // namespace velatura::integrator
