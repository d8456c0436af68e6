// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "statistics/relative_error.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::statistics {

/// What an image showed of its noise at a moment of its render.
struct ErrorObservation {
    uint64_t samples_min = 0, samples_max = 0;  ///< of any pixel
    double samples_mean = 0;
    double time_s = 0;  ///< since the first sample
    statistics::RelativeError
        change;  ///< since every pixel had half its samples: image::image_change
};

/// The error at a number of samples. ErrorCurve::points.
struct ErrorPoint {
    double samples_mean = 0;
    double time_s = 0;
    statistics::RelativeError error;
};

/// How the error falls: error ∝ samples^−value.
struct ErrorSlope {
    double value = 0;
    double deviation = 0;  ///< standard deviation of the value
};

/// Which samples and how much time would bring an image to an error; with 95 % intervals.
struct ErrorForecast {
    enum class Kind : uint8_t {
        Reached,  ///< the last point is no worse: nothing else is set
        Known,
        TooFar,  ///< more than ErrorCurve::farthest times the samples: nothing else is set
        Rare,    ///< ErrorCurve::is_rare: nothing else is set
    };

    Kind kind = Kind::Known;
    double target = 0;
    /// ErrorCurve::is_lower: the error is no less than that, and what it needs no fewer.
    bool is_lower = false;
    double samples = 0, samples_low = 0, samples_high = 0;  ///< per pixel, in the mean
    double time_s = 0, time_low_s = 0, time_high_s = 0;     ///< since the first sample
};

/// The error of an image against its samples, as its render shows it.
///
/// Errors fall by a power of the samples that lies between −1/2 (independent samples) and that of
/// scrambled nets, which integrands with edges keep near −1/2 … −3/4 (Owen 1997, "Scrambled net
/// variance for integrals of smooth functions"; Heitz, Belcour 2019). The slope is fitted to the
/// last doublings, older ones with less weight, since curves bend; what few points leave open comes
/// from that experience.
class ErrorCurve {
  public:
    static constexpr double farthest =
        10;  ///< times the samples that it has: no forecast goes beyond

    /// Adds an observation with more samples than those before. Those without change are left out.
    void add(const ErrorObservation& observation);

    bool is_empty() const { return observations_.empty(); }

    /// The error is no less than what the curve says: is_rare(), or few pixels hold most of it
    /// (image::RelativeError::is_lower of the last observation).
    bool is_lower() const;

    /// What was added, in that order.
    std::vector<ErrorObservation> observations() const;

    ErrorSlope slope() const;

    /// Errors fall far more slowly than those of independent samples, or grow: some light is met so
    /// rarely that the image does not know its noise yet, and the error is more than it says.
    bool is_rare() const;

    /// The error itself at each observation, with what the slope leaves open in the interval.
    std::vector<ErrorPoint> points() const;

    /// At the last observation, or later at this many samples per pixel; needs an observation.
    statistics::RelativeError error_at(double samples_mean) const;

    /// Needs an observation.
    ErrorForecast forecast(double target) const;

  private:
    struct Observation {
        ErrorObservation seen;
        int run;  ///< observations of one run differ in the number of samples alone, by doublings
    };

    /// Sums over the observations, by their weights.
    struct Moments {
        double weight = 0, x = 0, y = 0;
    };

    static double deviation_of(const Observation& o);
    double weight_of(const Observation& o) const;
    Moments moments_of(int run) const;
    /// Natural logarithm of what is to be added to that of an observation to get the error.
    static double offset(double slope);

    std::vector<Observation> observations_;
};

}  // namespace velatura::statistics
