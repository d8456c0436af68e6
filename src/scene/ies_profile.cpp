// SPDX-License-Identifier: Apache-2.0
#include "scene/ies_profile.h"

#include "base/math.h"

#include <algorithm>
#include <cmath>

namespace velatura::scene {

namespace {

/// Between two of the angles: f of the way from one number to the other.
struct Between {
    size_t from, to;
    double f;
};

Between find_vertical(const std::vector<double>& angles, double angle) {
    const auto above = std::upper_bound(angles.begin() + 1, angles.end() - 1, angle);
    const auto to = size_t(above - angles.begin());
    return {to - 1, to, (angle - angles[to - 1]) / (angles[to] - angles[to - 1])};
}

Between find_horizontal(const std::vector<double>& angles, double angle) {
    const size_t count = angles.size();
    if (count == 1) return {0, 0, 0.0};
    angle -= 2.0 * pi_d * std::floor(angle / (2.0 * pi_d));
    const auto to = size_t(std::upper_bound(angles.begin(), angles.end(), angle) - angles.begin());
    if (to > 0 && to < count)
        return {to - 1, to, (angle - angles[to - 1]) / (angles[to] - angles[to - 1])};
    // Where the last meets the first
    const double gap = angles.front() + 2.0 * pi_d - angles.back();
    const double way = angle - angles.back() + (to == 0 ? 2.0 * pi_d : 0.0);
    return {count - 1, 0, way / gap};
}

/// ∫ of what goes linearly from a to b, times the sine, over the vertical angles between.
double integrate_with_sine(double a, double b, double from, double to) {
    const double slope = (b - a) / (to - from);
    return a * std::cos(from) - b * std::cos(to) + slope * (std::sin(to) - std::sin(from));
}

}  // namespace

double intensity(const IesProfile& p, double vertical, double horizontal) {
    if (vertical < p.vertical.front() || vertical > p.vertical.back()) return 0.0;
    const Between v = find_vertical(p.vertical, vertical);
    const Between h = find_horizontal(p.horizontal, horizontal);
    const double first = p.at(h.from, v.from) * (1.0 - v.f) + p.at(h.from, v.to) * v.f;
    const double second = p.at(h.to, v.from) * (1.0 - v.f) + p.at(h.to, v.to) * v.f;
    return first * (1.0 - h.f) + second * h.f;
}

double mean_intensity(const IesProfile& p) {
    const size_t count = p.horizontal.size();
    double sum = 0.0;
    for (size_t h = 0; h < count; ++h) {
        // Bilinear: as far as the middles to the neighbors on both sides
        double width = 2.0 * pi_d;
        if (count > 1) {
            const double before = h > 0 ? p.horizontal[h - 1] : p.horizontal.back() - 2.0 * pi_d;
            const double after =
                h + 1 < count ? p.horizontal[h + 1] : p.horizontal.front() + 2.0 * pi_d;
            width = 0.5 * (after - before);
        }
        for (size_t v = 0; v + 1 < p.vertical.size(); ++v)
            sum += width * integrate_with_sine(p.at(h, v), p.at(h, v + 1), p.vertical[v],
                                               p.vertical[v + 1]);
    }
    // As in the reference code, which leaves room for tables that reach a little over the horizon
    const bool is_sphere = p.vertical.back() - p.vertical.front() > 0.5 * pi_d + 0.1;
    return sum / (is_sphere ? 4.0 * pi_d : 2.0 * pi_d);
}

}  // namespace velatura::scene
