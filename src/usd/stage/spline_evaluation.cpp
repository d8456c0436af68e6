// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/spline_evaluation.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace velatura::usd::stage {

using layer::SplineCurve;
using layer::SplineExtrapolation;
using layer::SplineExtrapolationMode;
using layer::SplineInterpolation;
using layer::SplineKnot;
using layer::SplineValue;

namespace {

using Knots = std::vector<SplineKnot>;

double value_before(const SplineKnot& knot) {
    return knot.is_dual ? knot.pre_value : knot.value;
}

SplineKnot moved(SplineKnot knot, double time, double value) {
    knot.time += time;
    knot.value += value;
    knot.pre_value += value;
    return knot;
}

/// Ascending in time; of knots at one time the last counts.
Knots sorted_knots(const SplineValue& spline) {
    Knots knots = spline.knots;
    std::stable_sort(knots.begin(), knots.end(),
                     [](const SplineKnot& a, const SplineKnot& b) { return a.time < b.time; });
    Knots unique;
    for (SplineKnot& knot : knots) {
        if (!std::isfinite(knot.time)) continue;
        if (!unique.empty() && unique.back().time == knot.time) unique.pop_back();
        unique.push_back(std::move(knot));
    }
    return unique;
}

/// The knots that count. With an inner loop the copies are not spelled out: the prototype is kept
/// once, closed by a copy of its first knot.
struct Shape {
    Knots before;     ///< up to the first copy, which closes it; all knots where nothing loops
    Knots prototype;  ///< empty where nothing loops
    Knots after;      ///< from the last copy on
    double loop_start = 0.0;
    double loop_end = 0.0;
    double span = 0.0;
    double offset = 0.0;
    double proto_start = 0.0;

    const SplineKnot& first() const { return before.front(); }

    const SplineKnot& last() const { return prototype.empty() ? before.back() : after.back(); }
};

Shape make_shape(const SplineValue& spline) {
    Shape shape;
    const Knots knots = sorted_knots(spline);
    const layer::SplineLoop& loop = spline.loop;
    const double pre = double(std::max(0, loop.pre_count));
    const double post = double(std::max(0, loop.post_count));
    const auto start = std::find_if(knots.begin(), knots.end(), [&](const SplineKnot& knot) {
        return knot.time == loop.start;
    });
    const double span = loop.end - loop.start;
    if ((pre == 0.0 && post == 0.0) || !(span > 0.0) || start == knots.end()) {
        shape.before = knots;
        return shape;
    }
    shape.span = span;
    shape.offset = loop.value_offset;
    shape.proto_start = loop.start;
    shape.loop_start = loop.start - pre * span;
    shape.loop_end = loop.end + post * span;
    for (const SplineKnot& knot : knots) {
        // Authored knots that the copies cover do not count
        if (knot.time < shape.loop_start) shape.before.push_back(knot);
        if (knot.time >= loop.start && knot.time < loop.end) shape.prototype.push_back(knot);
    }
    const SplineKnot head = *start;
    shape.before.push_back(moved(head, -pre * span, -pre * loop.value_offset));
    shape.prototype.push_back(moved(head, span, loop.value_offset));
    shape.after.push_back(moved(head, (post + 1.0) * span, (post + 1.0) * loop.value_offset));
    for (const SplineKnot& knot : knots) {
        if (knot.time > shape.loop_end) shape.after.push_back(knot);
    }
    return shape;
}

/// Value at t of the Bezier segment between two knots.
double bezier(const SplineKnot& a, const SplineKnot& b, double t) {
    const double length = b.time - a.time;
    double wa = std::max(0.0, a.post.width) / length;
    double wb = std::max(0.0, b.pre.width) / length;
    // Time runs forward iff wa + wb - sqrt(wa wb) <= 1
    const double excess = wa + wb - std::sqrt(wa * wb);
    if (excess > 1.0) {
        wa /= excess;
        wb /= excess;
    }
    const double target = (t - a.time) / length;
    const auto cubic = [](double p1, double p2, double p3, double u) {
        const double v = 1.0 - u;
        return 3.0 * v * v * u * p1 + 3.0 * v * u * u * p2 + u * u * u * p3;
    };
    // Bisection: steady, and as exact as doubles allow
    double low = 0.0;
    double high = 1.0;
    for (int i = 0; i < 64 && low < high; ++i) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        (cubic(wa, 1.0 - wb, 1.0, middle) < target ? low : high) = middle;
    }
    const double end = value_before(b) - a.value;
    return a.value + cubic(wa * length * a.post.slope, end - wb * length * b.pre.slope, end,
                           0.5 * (low + high));
}

double hermite(const SplineKnot& a, const SplineKnot& b, double t) {
    const double length = b.time - a.time;
    const double u = (t - a.time) / length;
    const double u2 = u * u;
    const double u3 = u2 * u;
    return (2.0 * u3 - 3.0 * u2 + 1.0) * a.value + (u3 - 2.0 * u2 + u) * length * a.post.slope +
           (3.0 * u2 - 2.0 * u3) * value_before(b) + (u3 - u2) * length * b.pre.slope;
}

/// Value at t in [first, last] of some knots.
std::optional<double> inside(std::span<const SplineKnot> knots, SplineCurve curve, double t) {
    const auto after =
        std::upper_bound(knots.begin(), knots.end(), t,
                         [](double time, const SplineKnot& knot) { return time < knot.time; });
    const SplineKnot& a = after == knots.begin() ? knots.front() : *(after - 1);
    if (t <= a.time || after == knots.end()) {
        // The last knot of a spline has no segment after it, but it has a value
        return a.next == SplineInterpolation::None && after != knots.end()
                   ? std::nullopt
                   : std::optional<double>(a.value);
    }
    const SplineKnot& b = *after;
    switch (a.next) {
        case SplineInterpolation::None:
            return std::nullopt;
        case SplineInterpolation::Held:
            return a.value;
        case SplineInterpolation::Linear:
            return a.value + (value_before(b) - a.value) * ((t - a.time) / (b.time - a.time));
        case SplineInterpolation::Curve:
            return curve == SplineCurve::Bezier ? bezier(a, b, t) : hermite(a, b, t);
    }
    return std::nullopt;
}

/// Value at t between the first and the last knot.
std::optional<double> on_knots(const Shape& shape, SplineCurve curve, double t) {
    if (shape.prototype.empty() || t < shape.loop_start) return inside(shape.before, curve, t);
    if (t >= shape.loop_end) return inside(shape.after, curve, t);
    const double turn = std::floor((t - shape.proto_start) / shape.span);
    const double at =
        std::clamp(t - turn * shape.span, shape.proto_start, shape.proto_start + shape.span);
    const auto value = inside(shape.prototype, curve, at);
    return value ? std::optional<double>(*value + turn * shape.offset) : std::nullopt;
}

/// Slope at the end of a segment, seen from outside.
double end_slope(const SplineKnot& a, const SplineKnot& b, bool at_start) {
    switch (a.next) {
        case SplineInterpolation::Linear:
            return (value_before(b) - a.value) / (b.time - a.time);
        case SplineInterpolation::Curve:
            return at_start ? a.post.slope : b.pre.slope;
        default:
            return 0.0;
    }
}

double linear_slope(const Shape& shape, bool at_start) {
    const bool loops = !shape.prototype.empty();
    // The outermost two knots may be copies in the loop
    const Knots& head = loops && shape.before.size() == 1 ? shape.prototype : shape.before;
    const Knots& tail = !loops                   ? shape.before
                        : shape.after.size() > 1 ? shape.after
                                                 : shape.prototype;
    const Knots& knots = at_start ? head : tail;
    if (knots.size() < 2) return 0.0;
    return at_start ? end_slope(knots[0], knots[1], true)
                    : end_slope(knots[knots.size() - 2], knots.back(), false);
}

std::optional<double> extrapolated(const Shape& shape,
                                   const SplineValue& spline,
                                   double t,
                                   bool at_start) {
    const SplineExtrapolation& how = at_start ? spline.pre : spline.post;
    const SplineKnot& first = shape.first();
    const SplineKnot& last = shape.last();
    const double edge_time = at_start ? first.time : last.time;
    const double edge_value = at_start ? value_before(first) : last.value;
    const double span = last.time - first.time;
    switch (how.mode) {
        case SplineExtrapolationMode::None:
            return std::nullopt;
        case SplineExtrapolationMode::Held:
            return edge_value;
        case SplineExtrapolationMode::Linear:
            return edge_value + linear_slope(shape, at_start) * (t - edge_time);
        case SplineExtrapolationMode::Sloped:
            return edge_value + how.slope * (t - edge_time);
        default:
            break;
    }
    if (!(span > 0.0)) return edge_value;
    const double turn = std::floor((t - first.time) / span);
    double at = std::clamp(t - turn * span, first.time, last.time);
    const bool is_odd = std::fmod(turn, 2.0) != 0.0;
    if (how.mode == SplineExtrapolationMode::LoopOscillate && is_odd)
        at = last.time - (at - first.time);
    const auto value = on_knots(shape, spline.curve, at);
    if (!value || how.mode != SplineExtrapolationMode::LoopRepeat) return value;
    return *value + turn * (value_before(last) - first.value);
}

}  // namespace

std::optional<double> evaluate_spline(const SplineValue& spline, double time) {
    const Shape shape = make_shape(spline);
    if (shape.before.empty() || std::isnan(time)) return std::nullopt;
    if (time < shape.first().time) return extrapolated(shape, spline, time, true);
    if (time > shape.last().time) return extrapolated(shape, spline, time, false);
    return on_knots(shape, spline.curve, time);
}

}  // namespace velatura::usd::stage
