// SPDX-License-Identifier: Apache-2.0
#include "study/statistics.h"

#include "statistics/relative_error.h"

#include <algorithm>
#include <cmath>

namespace velatura::study {

double GroupMeans::mean_without(size_t group) const {
    double s = 0, n = 0;
    for (size_t g = 0; g < groups; ++g) {
        if (g == group) continue;
        s += sum[g];
        n += count[g];
    }
    return n > 0 ? s / n : 0.0;
}

double GroupMeans::standard_error() const {
    const double all = mean();
    double square = 0;
    for (size_t g = 0; g < groups; ++g) {
        const double d = mean_without(g) - all;
        square += d * d;
    }
    return std::sqrt(square * double(groups - 1) / double(groups));
}

Reference make_reference(const std::vector<Setting>& settings,
                         const Tallies& tallies,
                         uint64_t spp) {
    Reference reference;
    double weights = 0;
    for (size_t s = 0; s < settings.size(); ++s) {
        if (settings[s].bias_class != BiasClass::Unbiased || settings[s].anchor != 0) continue;
        const PointTally* p = tallies.settings[s].at(spp);
        if (!p) continue;
        // What it is worth goes by its spread, measured against its own mean
        Reference own;
        for (size_t i = 0; i < p->image.sum.size(); ++i) own.means.push_back(p->image.mean(i));
        const double noise = p->image.count > 1 ? noise_squares(p->image, own).mean() : 1.0;
        const double weight = double(p->image.count) / std::max(noise, 1e-12);
        reference.means.resize(own.means.size(), 0.0);
        for (size_t i = 0; i < own.means.size(); ++i) reference.means[i] += weight * own.means[i];
        weights += weight;
    }
    for (double& m : reference.means) m /= weights;
    const Reference as_it_is = reference;
    for (size_t s = 1; s < settings.size(); ++s) {
        const Moments& difference = tallies.settings[s].difference;
        if (settings[s].anchor != s || !test_difference(difference, as_it_is).is_seen) continue;
        for (size_t i = 0; i < reference.means.size(); ++i)
            reference.means[i] = std::max(reference.means[i] + difference.mean(i), 0.0);
    }
    return reference;
}

GroupMeans noise_squares(const Moments& image, const Reference& reference) {
    GroupMeans squares;
    if (image.count < 2) return squares;
    for (size_t i = 0; i < image.sum.size(); ++i)
        squares.add(i / 3, statistics::relative_square(image.variance(i), reference.means[i]));
    return squares;
}

GroupMeans bias_squares(const Moments& difference, const Reference& reference) {
    GroupMeans squares;
    if (difference.count < 2) return squares;
    for (size_t i = 0; i < difference.sum.size(); ++i) {
        const double d = difference.mean(i);
        squares.add(i / 3,
                    statistics::relative_square(d * d - difference.variance(i) / difference.count,
                                                reference.means[i]));
    }
    return squares;
}

DifferenceTest test_difference(const Moments& difference, const Reference& reference) {
    DifferenceTest t;
    if (difference.count < 2) return t;
    t.is_same_image = std::all_of(difference.square.begin(), difference.square.end(),
                                  [](double v) { return v == 0.0; });
    if (t.is_same_image) return t;

    // Energy: pixels are independent, so that their variances add up; the channels of one are not,
    // and their deviations do
    double shift = 0, variance = 0, energy = 0, deviation = 0;
    for (size_t i = 0; i < difference.sum.size(); ++i) {
        shift += difference.mean(i);
        energy += reference.means[i];
        deviation += std::sqrt(difference.variance(i) / difference.count);
        if (i % 3 != 2) continue;
        variance += deviation * deviation;
        deviation = 0;
    }
    energy = std::max(energy, 1e-30);
    t.shift = shift / energy;
    t.shift_se = std::sqrt(variance) / energy;

    // Four and a half standard errors: one false alarm in some thousand studies of fifty settings,
    // heavy tails allowed for
    constexpr double sure = 4.5;
    const GroupMeans squares = bias_squares(difference, reference);
    const double mean = squares.mean(), se = squares.standard_error();
    // A shift that noise cannot explain, however small, and one that leaves the energy as it is
    const bool is_shifted = std::abs(t.shift) > sure * t.shift_se && std::abs(t.shift) > 1e-7;
    t.is_seen = is_shifted || (mean > sure * se && mean > 1e-14);
    t.bias = t.is_seen ? std::max(std::sqrt(std::max(mean, 0.0)), std::abs(t.shift)) : 0.0;
    t.bias_limit = std::sqrt(std::max(mean, 0.0) + 1.96 * se);
    return t;
}

Slope fit_slope(const SettingTally& tally, const Reference& reference) {
    // Least squares of log noise over log samples, the groups of pixels left out in turn
    std::vector<double> x;
    std::vector<GroupMeans> squares;
    for (const PointTally& p : tally.points) {
        if (p.image.count < 2) continue;
        squares.push_back(noise_squares(p.image, reference));
        if (squares.back().mean() > 0)
            x.push_back(std::log(double(p.spp)));
        else
            squares.pop_back();
    }
    if (x.size() < 2) return {};
    const auto fit = [&](size_t omitted) {
        double mx = 0, my = 0, xx = 0, xy = 0;
        std::vector<double> y;
        for (const GroupMeans& g : squares)
            y.push_back(0.5 * std::log(std::max(g.mean_without(omitted), 1e-300)));
        for (size_t i = 0; i < x.size(); ++i) {
            mx += x[i] / double(x.size());
            my += y[i] / double(x.size());
        }
        for (size_t i = 0; i < x.size(); ++i) {
            xx += (x[i] - mx) * (x[i] - mx);
            xy += (x[i] - mx) * (y[i] - my);
        }
        return xy / xx;
    };
    Slope slope;
    slope.value = fit(GroupMeans::groups);
    double square = 0;
    for (size_t g = 0; g < GroupMeans::groups; ++g) {
        const double d = fit(g) - slope.value;
        square += d * d;
    }
    slope.standard_error =
        std::sqrt(square * double(GroupMeans::groups - 1) / double(GroupMeans::groups));
    slope.is_known = true;
    return slope;
}

std::optional<TimeRatio> time_ratio(const SettingTally& a, const SettingTally& b, uint64_t spp) {
    const PointTally* pa = a.at(spp);
    const PointTally* pb = b.at(spp);
    if (!pa || !pb) return std::nullopt;
    std::vector<double> logs;
    for (size_t i = 0; i < a.rounds.size(); ++i) {
        const auto j = std::find(b.rounds.begin(), b.rounds.end(), a.rounds[i]);
        if (j == b.rounds.end()) continue;
        logs.push_back(std::log(std::max(pa->cpu_s[i], 1e-9) /
                                std::max(pb->cpu_s[size_t(j - b.rounds.begin())], 1e-9)));
    }
    if (logs.size() < 2) return std::nullopt;
    double mean = 0, square = 0;
    for (const double l : logs) mean += l / double(logs.size());
    for (const double l : logs) square += (l - mean) * (l - mean);
    const int degrees = int(logs.size()) - 1;
    // As a standard error that a normal distribution would have for the same interval
    const double se =
        std::sqrt(square / degrees / double(logs.size())) * student_975(degrees) / 1.96;
    return TimeRatio{std::exp(mean), se};
}

double student_975(int degrees) {
    // Of 1 to 16 degrees; beyond that the expansion of Abramowitz & Stegun 26.7.5 to its second
    // term
    static constexpr std::array<double, 16> table = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447,
                                                     2.365,  2.306, 2.262, 2.228, 2.201, 2.179,
                                                     2.160,  2.145, 2.131, 2.120};
    if (degrees < 1) return table[0];
    if (degrees <= int(table.size())) return table[size_t(degrees) - 1];
    constexpr double z = 1.959964;
    const double n = degrees;
    return z + (z * z * z + z) / (4 * n) +
           (5 * z * z * z * z * z + 16 * z * z * z + 3 * z) / (96 * n * n);
}

}  // namespace velatura::study
