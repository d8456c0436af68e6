// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/knobs.h"
#include "study/tally.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::study {

/// A number with its 95 % interval.
struct Estimate {
    double value = 0, low = 0, high = 0;
};

/// Means over groups of pixels that lie apart from one another: what leaving one out at a time
/// tells how sure a number is that is made of them (delete-a-group jackknife: Wolter 2007,
/// Introduction to Variance Estimation, chapter 4).
struct GroupMeans {
    static constexpr size_t groups = 32;
    std::array<double, groups> sum = {}, count = {};

    void add(size_t pixel, double value) {
        // Neighbors fall into different groups, whatever the width of the image
        const size_t g = (pixel * 0x9e3779b97f4a7c15ull) >> 59;
        sum[g] += value;
        count[g] += 1;
    }

    double mean() const { return mean_without(groups); }

    /// group: which to leave out; `groups` = none.
    double mean_without(size_t group) const;
    double standard_error() const;
};

/// Error measures are squares of relative errors as in docs/engineering/numerics.md: mean of (x −
/// ref)² / (ref² + 0.01), where ref is the mean of all renders without bias together: where the
/// render as it is has biased settings, with what they remove.
struct Reference {
    std::vector<double> means;  // [pixel][3]
};

/// Mean of the settings with the mean of the render as it is, more weight to the less noisy, and
/// the differences that the exact values of its biased settings are seen to make.
Reference make_reference(const std::vector<Setting>& settings,
                         const Tallies& tallies,
                         uint64_t spp);

/// Squared relative noise of one render, from the spread over rounds.
GroupMeans noise_squares(const Moments& image, const Reference& reference);

/// Squared relative difference of two settings' means. Without bias: what noise adds to it is taken
/// off, so that it may come out below zero.
GroupMeans bias_squares(const Moments& difference, const Reference& reference);

/// Whether two settings differ in the mean.
struct DifferenceTest {
    bool is_same_image = false;      ///< bit for bit in every round
    double shift = 0, shift_se = 0;  ///< of the image's energy, relative
    double bias = 0;        ///< root of the squared relative difference; 0 where nothing is seen
    double bias_limit = 0;  ///< a bias above it would have been seen (95 %)
    bool is_seen = false;   ///< beyond chance, counting that many settings are tested
};

DifferenceTest test_difference(const Moments& difference, const Reference& reference);

/// Slope of the logarithm of the noise over that of the samples.
struct Slope {
    double value = -0.5, standard_error = 0;
    bool is_known = false;
};

Slope fit_slope(const SettingTally& tally, const Reference& reference);

/// exp of the mean of log(a / b) over rounds that both took part in, with its standard error.
/// Nothing before two of them.
struct TimeRatio {
    double value = 1, log_se = 0;
};

std::optional<TimeRatio> time_ratio(const SettingTally& a, const SettingTally& b, uint64_t spp);

/// The 97.5 % point of Student's distribution.
double student_975(int degrees);

}  // namespace velatura::study
