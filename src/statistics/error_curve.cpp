// SPDX-License-Identifier: Apache-2.0
#include "statistics/error_curve.h"

#include "statistics/image_change.h"

#include <algorithm>
#include <cmath>

namespace velatura::statistics {

namespace {

constexpr double quantile = 1.96;

constexpr ErrorSlope usual = {statistics::usual_slope, statistics::usual_slope_deviation};

// No observation is better than the first of these; one from k doublings ago is k² times the second
// off its line, and one of n samples per pixel the third over n: the first samples of a pixel do
// not behave as many do
constexpr double min_deviation = 0.005, bend = 0.01, young = 0.25;

// Slopes of images that meet all their light are 0.48 at least, among scenes/; and what is not
// sure is taken to be usual
constexpr double rare_slope = 0.44;

// Relative squares divide by the noisy image itself: an error of e is not known better than to
// this times e
constexpr double unsettled = 0.25;

statistics::RelativeError with_interval(double value, double deviation) {
    return {.value = value,
            .low = value * std::exp(-quantile * deviation),
            .high = value * std::exp(quantile * deviation)};
}

/// What an estimate says of itself beside its value and interval.
void copy_bound(const RelativeError& from, RelativeError& to) {
    to.half_in = from.half_in;
    to.is_lower = from.is_lower;
    to.worst_x = from.worst_x;
    to.worst_y = from.worst_y;
}

}  // namespace

void ErrorCurve::add(const ErrorObservation& seen) {
    if (!(seen.change.value > 0)) return;
    int run = 0;
    if (!observations_.empty()) {
        const Observation& last = observations_.back();
        // Where samples begin to go by noise, pixels that get few wait: the first doubling after
        // that is not like the next
        const bool is_doubled = seen.samples_max == 2 * last.seen.samples_max &&
                                std::abs(seen.samples_mean / last.seen.samples_mean - 2) < 0.02;
        run = is_doubled ? last.run : last.run + 1;
    }
    observations_.push_back({seen, run});
}

std::vector<ErrorObservation> ErrorCurve::observations() const {
    std::vector<ErrorObservation> all;
    for (const Observation& o : observations_) all.push_back(o.seen);
    return all;
}

double ErrorCurve::deviation_of(const Observation& o) {
    // Of the logarithm; where the interval reaches down to nothing, its upper side tells
    const double spread = std::log(o.seen.change.high / o.seen.change.value) / quantile;
    const double doubt = unsettled * o.seen.change.value;
    return std::sqrt(min_deviation * min_deviation + spread * spread + doubt * doubt);
}

double ErrorCurve::weight_of(const Observation& o) const {
    // All of a run are about as precise; what each says of its own precision is part of the same
    // noise
    double square = 0, count = 0;
    for (const Observation& other : observations_) {
        if (other.run != o.run) continue;
        square += deviation_of(other) * deviation_of(other);
        count += 1;
    }
    const double age = std::log2(observations_.back().seen.samples_mean / o.seen.samples_mean);
    const double bent = std::hypot(bend * age * age, young / o.seen.samples_mean);
    return 1 / (square / count + bent * bent);
}

ErrorCurve::Moments ErrorCurve::moments_of(int run) const {
    Moments m;
    for (const Observation& o : observations_) {
        if (o.run != run) continue;
        const double w = weight_of(o);
        m.weight += w;
        m.x += w * std::log(o.seen.samples_mean);
        m.y += w * std::log(o.seen.change.value);
    }
    m.x /= m.weight;
    m.y /= m.weight;
    return m;
}

ErrorSlope ErrorCurve::slope() const {
    // Each run has a line of its own; the lines are parallel
    double xx = 0, xy = 0, yy = 0, freedom = -1;
    const int runs = observations_.empty() ? 0 : observations_.back().run + 1;
    for (int run = 0; run < runs; ++run) {
        const Moments m = moments_of(run);
        freedom -= 1;
        for (const Observation& o : observations_) {
            if (o.run != run) continue;
            const double dx = std::log(o.seen.samples_mean) - m.x;
            const double dy = std::log(o.seen.change.value) - m.y, w = weight_of(o);
            xx += w * dx * dx;
            xy += w * dx * dy;
            yy += w * dy * dy;
            freedom += 1;
        }
    }
    if (!(xx > 0)) return usual;
    const double fitted = -xy / xx;
    // Observations that lie further off than their intervals say make it less certain
    const double excess = freedom > 0 ? std::max(1.0, (yy - xy * xy / xx) / freedom) : 1.0;
    const double precision = xx / excess;
    // An image that is plainly not like the others is less bound to them
    const double beyond_chance =
        std::max(0.0, std::abs(fitted - usual.value) - quantile / std::sqrt(precision));
    const double doubt = std::max(usual.deviation, 0.5 * beyond_chance);
    const double known = 1 / (doubt * doubt);
    const double value = (precision * fitted + known * usual.value) / (precision + known);
    return {std::clamp(value, 0.3, 1.5), 1 / std::sqrt(precision + known)};
}

bool ErrorCurve::is_rare() const {
    return slope().value < rare_slope;
}

bool ErrorCurve::is_lower() const {
    return !is_empty() && (is_rare() || observations_.back().seen.change.is_lower);
}

double ErrorCurve::offset(double slope) {
    return std::log(statistics::net_factor(slope));
}

std::vector<ErrorPoint> ErrorCurve::points() const {
    const ErrorSlope s = slope();
    const double open = 0.5 * (offset(s.value + s.deviation) - offset(s.value - s.deviation));
    std::vector<ErrorPoint> points;
    for (const Observation& o : observations_) {
        const double value = o.seen.change.value * std::exp(offset(s.value));
        points.push_back({o.seen.samples_mean, o.seen.time_s,
                          with_interval(value, std::hypot(deviation_of(o), open))});
        copy_bound(o.seen.change, points.back().error);
    }
    if (points.empty()) return points;

    // Of the last one the others of its run know something too
    const Moments m = moments_of(observations_.back().run);
    const double ahead = std::log(points.back().samples_mean) - m.x;
    const double value = std::exp(m.y + offset(s.value) - s.value * ahead);
    const double deviation = std::hypot(1 / std::sqrt(m.weight), open, ahead * s.deviation);
    const statistics::RelativeError seen = points.back().error;
    points.back().error = with_interval(value, deviation);
    copy_bound(seen, points.back().error);
    return points;
}

statistics::RelativeError ErrorCurve::error_at(double samples_mean) const {
    const ErrorPoint last = points().back();
    // Sobol' points gain by more than independent ones at powers of two only
    const double fall = std::min(slope().value, 0.5);
    const double factor = std::pow(std::min(1.0, last.samples_mean / samples_mean), fall);
    statistics::RelativeError error = last.error;
    error.value *= factor;
    error.low *= factor;
    error.high *= factor;
    return error;
}

ErrorForecast ErrorCurve::forecast(double target) const {
    const ErrorObservation& last = observations_.back().seen;
    const ErrorSlope s = slope();
    const Moments m = moments_of(observations_.back().run);

    // Logarithm of the samples at which the line of the last run meets the target
    const auto meets = [&](double slope) {
        return m.x + (m.y + offset(slope) - std::log(target)) / slope;
    };
    ErrorForecast f;
    f.target = target;
    f.is_lower = is_lower();
    if (is_rare()) {
        f.kind = ErrorForecast::Kind::Rare;
        return f;
    }
    const double x = meets(s.value), x_last = std::log(last.samples_mean);
    if (points().back().error.value <= target) {
        f.kind = ErrorForecast::Kind::Reached;
        return f;
    }
    if (x > x_last + std::log(farthest)) {
        f.kind = ErrorForecast::Kind::TooFar;
        return f;
    }
    const double by_slope = 0.5 * (meets(s.value + s.deviation) - meets(s.value - s.deviation));
    const double deviation = std::hypot(by_slope, 1 / (s.value * std::sqrt(m.weight)));
    const auto samples = [&](double deviations) {
        return std::exp(std::max(x_last, x + deviations * deviation));
    };
    f.samples = samples(0);
    f.samples_low = samples(-quantile);
    f.samples_high = samples(quantile);

    // Time goes on as in the last pass
    double before = 0, time_before_s = 0;
    if (observations_.size() > 1) {
        const ErrorObservation& o = observations_[observations_.size() - 2].seen;
        before = o.samples_mean;
        time_before_s = o.time_s;
    }
    const double sample_s = (last.time_s - time_before_s) / (last.samples_mean - before);
    const auto time_s = [&](double n) { return last.time_s + sample_s * (n - last.samples_mean); };
    f.time_s = time_s(f.samples);
    f.time_low_s = time_s(f.samples_low);
    f.time_high_s = time_s(f.samples_high);
    return f;
}

}  // namespace velatura::statistics
