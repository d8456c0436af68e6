// SPDX-License-Identifier: Apache-2.0
#include "sampling/filter.h"

#include <array>
#include <cmath>
#include <utility>

namespace velatura::sampling {

namespace {

constexpr std::array<std::pair<FilterKind, std::string_view>, 5> names = {{
    {FilterKind::Box, "box"},
    {FilterKind::Triangle, "triangle"},
    {FilterKind::Gaussian, "gaussian"},
    {FilterKind::BlackmanHarris, "blackman-harris"},
    {FilterKind::Mitchell, "mitchell"},
}};

constexpr int integration_steps = 1 << 14;  // of the profile on [0, radius]
constexpr size_t table_steps = 2048;        // of the inverse

float default_radius(FilterKind kind) {
    switch (kind) {
        case FilterKind::Box:
            return 0.5f;
        case FilterKind::Triangle:
            return 1.0f;
        case FilterKind::Gaussian:
            return 1.5f;
        case FilterKind::BlackmanHarris:
            return 1.5f;
        case FilterKind::Mitchell:
            return 2.0f;
    }
    return 0.5f;
}

/// B = C = 1/3, x in [0, 2]. Ref: Mitchell & Netravali 1988.
double mitchell(double x) {
    constexpr double b = 1.0 / 3.0, c = 1.0 / 3.0;
    if (x >= 2.0) return 0.0;
    if (x > 1.0) {
        return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x +
                (8 * b + 24 * c)) /
               6.0;
    }
    return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6.0;
}

}  // namespace

std::optional<FilterKind> filter_kind(std::string_view name) {
    for (const auto& [kind, text] : names) {
        if (text == name) return kind;
    }
    return std::nullopt;
}

std::string_view filter_name(FilterKind kind) {
    for (const auto& [k, text] : names) {
        if (k == kind) return text;
    }
    return "";
}

PixelFilter::PixelFilter(FilterKind kind, float radius)
    : kind_(kind), radius_(radius > 0.0f ? radius : default_radius(kind)) {
    if (kind_ == FilterKind::Box || kind_ == FilterKind::Triangle) {
        inverse_integral_ =
            1.0 / (kind_ == FilterKind::Box ? 2.0 * double(radius_) : double(radius_));
        return;
    }
    // Integrate the right half of the profile and of its absolute value by the trapezoid rule
    const double step = double(radius_) / integration_steps;
    std::vector<double> cumulative(integration_steps + 1, 0.0);
    double sum = 0;
    double previous = raw_profile(0);
    for (int i = 1; i <= integration_steps; ++i) {
        const double value = raw_profile(i * step);
        sum += 0.5 * (value + previous) * step;
        cumulative[size_t(i)] =
            cumulative[size_t(i) - 1] + 0.5 * (std::abs(value) + std::abs(previous)) * step;
        previous = value;
    }
    inverse_integral_ = 0.5 / sum;
    absolute_integral_ = cumulative.back() / sum;
    // Tabulate the offset over q with 1 − CDF = (1 − q)^4: steps get finer in the tail, where
    // little mass is far away
    inverse_cdf_.resize(table_steps + 1);
    size_t j = 0;
    for (size_t i = 0; i <= table_steps; ++i) {
        const double rest = sqr(sqr(1.0 - double(i) / double(table_steps)));
        const double target = cumulative.back() * (1.0 - rest);
        while (j + 1 < cumulative.size() - 1 && cumulative[j + 1] < target) ++j;
        const double span = cumulative[j + 1] - cumulative[j];
        const double t = span > 0 ? std::min((target - cumulative[j]) / span, 1.0) : 0.0;
        inverse_cdf_[i] = float((double(j) + t) * step);
    }
    inverse_cdf_.back() = radius_;
}

double PixelFilter::raw_profile(double x) const {
    x = std::abs(x);
    const double r = double(radius_);
    if (x > r) return 0.0;
    switch (kind_) {
        case FilterKind::Box:
            return 1.0;
        case FilterKind::Triangle:
            return 1.0 - x / r;
        case FilterKind::Gaussian: {
            // σ is a third of the radius; subtract the value at the edge, so that the filter ends
            // at 0
            const double a = 4.5 / (r * r);
            return std::exp(-a * x * x) - std::exp(-a * r * r);
        }
        case FilterKind::BlackmanHarris: {
            // Ref: Harris 1978, four-term window
            const double t = pi_d * (x / r + 1.0);
            return 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) -
                   0.01168 * std::cos(3 * t);
        }
        case FilterKind::Mitchell:
            return mitchell(2.0 * x / r);
    }
    return 0.0;
}

double PixelFilter::profile(double x) const {
    return raw_profile(x) * inverse_integral_;
}

float PixelFilter::sample_axis(float u, float begin, float end) const {
    if (kind_ == FilterKind::Box) return (2.0f * u - 1.0f) * radius_;
    // Fold the unit interval onto the right half, and back, without a branch that nobody predicts
    const float side = 2.0f * u - 1.0f, v = begin + (end - begin) * std::abs(side);
    float x = 0;
    if (kind_ == FilterKind::Triangle) {
        x = radius_ * (1.0f - std::sqrt(1.0f - v));
    } else {
        const float scaled = (1.0f - std::sqrt(std::sqrt(1.0f - v))) * float(table_steps);
        const size_t i = std::min(size_t(scaled), table_steps - 1);
        x = inverse_cdf_[i] + (scaled - float(i)) * (inverse_cdf_[i + 1] - inverse_cdf_[i]);
    }
    return std::copysign(x, side);
}

/// Along each axis the profile is positive up to a point and negative from there on. Where both
/// factors have one sign the filter adds, elsewhere it subtracts.
FilterSample PixelFilter::sample_part(const Vec2& u, float u_part) const {
    const float positive = 0.5f * float(absolute_integral_ + 1.0);
    const float negative = 0.5f * float(absolute_integral_ - 1.0);
    const float inner = positive / float(absolute_integral_);
    bool x_is_inner = true, y_is_inner = true;
    FilterSample s;
    if (u_part < 1.0f - negative_share) {
        const float adding = positive * positive + negative * negative;
        x_is_inner = y_is_inner = u_part * adding < (1.0f - negative_share) * positive * positive;
        s.weight = adding / (1.0f - negative_share);
    } else {
        x_is_inner = u_part < 1.0f - 0.5f * negative_share;
        y_is_inner = !x_is_inner;
        s.weight = -2.0f * positive * negative / negative_share;
    }
    s.offset.x = x_is_inner ? sample_axis(u.x, 0.0f, inner) : sample_axis(u.x, inner, 1.0f);
    s.offset.y = y_is_inner ? sample_axis(u.y, 0.0f, inner) : sample_axis(u.y, inner, 1.0f);
    return s;
}

FilterSample PixelFilter::sample(const Vec2& u, float u_part) const {
    if (has_negative_lobes()) return sample_part(u, u_part);
    FilterSample s;
    s.offset = {sample_axis(u.x, 0.0f, 1.0f), sample_axis(u.y, 0.0f, 1.0f)};
    return s;
}

}  // namespace velatura::sampling
