// SPDX-License-Identifier: Apache-2.0
#include "sampling/distribution.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::sampling {

namespace {

template <class T>
double usable(T weight) {
    return std::isfinite(weight) && weight > T(0) ? double(weight) : 0.0;
}

}  // namespace

Distribution1D::Distribution1D(std::span<const double> weights) {
    build(weights);
}

Distribution1D::Distribution1D(std::span<const float> weights) {
    build(weights);
}

template <class T>
void Distribution1D::build(std::span<const T> weights) {
    const size_t n = weights.size();
    if (n == 0) return;
    cdf_.assign(n + 1, 0.0);
    // Scale by a power of two first, so that huge weights do not overflow the sum and tiny ones
    // keep their digits
    double largest = 0;
    for (const T w : weights) largest = std::max(largest, usable(w));
    if (largest == 0) return;
    int exponent = 0;
    std::frexp(largest, &exponent);
    // What a double can hold: sums of weights below 2^24 do not overflow either
    exponent = std::clamp(exponent, -1000, 1000);
    const double scale = std::ldexp(1.0, -exponent);
    size_t last = 0;
    for (size_t i = 0; i < n; ++i) {
        const double w = usable(weights[i]) * scale;
        cdf_[i + 1] = cdf_[i] + w;
        if (cdf_[i + 1] > cdf_[i]) last = i;
    }
    const double total = cdf_[n];
    integral_ = std::ldexp(total / double(n), exponent);
    for (size_t i = 1; i <= last; ++i) cdf_[i] /= total;
    // Bins after the last that can be drawn must not catch a rounding remainder
    for (size_t i = last + 1; i <= n; ++i) cdf_[i] = 1.0;
}

Distribution1D::Sample Distribution1D::sample(float u) const {
    Sample s;
    if (integral_ == 0) return s;
    const double v = std::clamp(double(u), 0.0, 0x1.fffffep-1);
    // The first node above v ends the bin; a bin of no width is never the answer, because its end
    // is not above v before its start is
    const auto end = std::upper_bound(cdf_.begin() + 1, cdf_.end(), v);
    s.index = size_t(end - cdf_.begin()) - 1;
    s.pmf = pmf(s.index);
    const double n = double(size());
    s.pdf = s.pmf * n;
    const double inside = std::min((v - cdf_[s.index]) / s.pmf, 1.0 - 0x1p-53);
    s.u_remapped = std::min(float(inside), 0x1.fffffep-1f);
    s.x = std::min((double(s.index) + inside) / n, 1.0 - 0x1p-53);
    return s;
}

double Distribution1D::pdf(double x) const {
    if (integral_ == 0 || !(x >= 0.0 && x <= 1.0)) return 0.0;
    const size_t index = std::min(size_t(x * double(size())), size() - 1);
    return pmf(index) * double(size());
}

Distribution2D::Distribution2D(std::span<const float> weights, size_t width, size_t height) {
    VELATURA_CHECK(weights.size() == width * height, "Distribution2D: weights do not fit the size");
    columns_.reserve(height);
    std::vector<double> row_weights(height);
    for (size_t y = 0; y < height; ++y) {
        columns_.emplace_back(weights.subspan(y * width, width));
        row_weights[y] = columns_[y].integral();
    }
    rows_ = Distribution1D(std::span<const double>(row_weights));
}

Distribution2D::Sample Distribution2D::sample(const Vec2& u) const {
    Sample s;
    const Distribution1D::Sample row = rows_.sample(u.y);
    if (row.pdf == 0) return s;
    const Distribution1D::Sample column = columns_[row.index].sample(u.x);
    s.xy = Vec2d(column.x, row.x);
    s.pdf = row.pdf * column.pdf;
    s.column = column.index;
    s.row = row.index;
    return s;
}

double Distribution2D::pdf(const Vec2d& xy) const {
    const double row = rows_.pdf(xy.y);
    if (row == 0) return 0.0;
    const size_t y = std::min(size_t(xy.y * double(height())), height() - 1);
    return row * columns_[y].pdf(xy.x);
}

}  // namespace velatura::sampling
