// SPDX-License-Identifier: Apache-2.0
#include "image/picture_error.h"

#include "base/tasks.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>

namespace velatura::image {

namespace {

/// Sums down a column of a neighbourhood, or over such columns.
struct Sums {
    double count = 0, means = 0, squares = 0, variances = 0;

    void add(const Sums& s) {
        count += s.count;
        means += s.means;
        squares += s.squares;
        variances += s.variances;
    }
};

std::vector<Sums> column_sums(int width, int height, int y, const NoisyChannel& channel) {
    std::vector<Sums> columns(static_cast<size_t>(width));
    const int first = std::max(0, y - Neighbourhood::radius),
              last = std::min(height - 1, y + Neighbourhood::radius);
    for (int row = first; row <= last; ++row) {
        const size_t begin = size_t(row) * size_t(width);
        for (size_t x = 0; x < size_t(width); ++x) {
            const double mean = double(channel.mean[begin + x]);
            columns[x].add({1, mean, mean * mean, double(channel.variance[begin + x])});
        }
    }
    return columns;
}

/// The sum of the relative squares of a pixel's channels.
double relative_of(const NoisyPicture& picture,
                   const std::array<ErrorBases, 3>& bases,
                   std::vector<float> ErrorBases::*which,
                   size_t i) {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c)
        sum += relative_square(double(picture[c].variance[i]), double((bases[c].*which)[i]));
    return sum;
}

RelativeError error_of(const std::array<double, interleaved_sets>& squares,
                       const std::array<double, interleaved_sets>& counts) {
    RelativeErrorSum sum;
    for (size_t set = 0; set < interleaved_sets; ++set) sum.add_tile(squares[set], counts[set]);
    return sum.result();
}

/// What a quarter of the means around a pixel are below.
float lower_quarter(const NoisyChannel& channel, int width, int height, int x, int y) {
    constexpr int radius = Neighbourhood::radius;
    std::vector<float> means;
    for (int ny = std::max(0, y - radius); ny <= std::min(height - 1, y + radius); ++ny)
        for (int nx = std::max(0, x - radius); nx <= std::min(width - 1, x + radius); ++nx)
            if (nx != x || ny != y)
                means.push_back(channel.mean[size_t(ny) * size_t(width) + size_t(nx)]);
    if (means.empty()) return channel.mean[size_t(y) * size_t(width) + size_t(x)];
    const auto quarter = means.begin() + std::ptrdiff_t(means.size() / 4);
    std::nth_element(means.begin(), quarter, means.end());
    return *quarter;
}

constexpr size_t bin_bits = 18, bin_count = size_t(1) << (31 - bin_bits);

/// Of a square, which has no sign.
size_t bin_of(double square) {
    return std::bit_cast<uint32_t>(float(square)) >> bin_bits;
}

}  // namespace

ErrorBase error_base(double mean, double variance, const Neighbourhood& around) {
    if (!(variance > 0) || around.count == 0) return {mean, mean};
    const double middle = around.means / around.count;
    const double spread = std::max(0.0, around.squares / around.count - middle * middle);
    const double signal = std::max(0.0, spread - around.variances / around.count);
    const double blend = middle + signal / (signal + variance) * (mean - middle);
    const double reach = 2 * std::sqrt(variance);
    const double likely = std::clamp(blend, mean - reach, mean + reach);
    constexpr double far = 3;  // standard deviations of what is around
    const bool is_outlier = mean > middle + far * std::sqrt(spread);
    return {likely, is_outlier ? std::max(mean, likely) : likely};
}

ErrorBases error_bases(int width, int height, const NoisyChannel& channel) {
    const size_t pixels = channel.mean.size();
    ErrorBases bases{std::vector<float>(pixels), std::vector<float>(pixels),
                     std::vector<float>(pixels)};
    constexpr double near_mean = 0.7;
    for_each_row({0, 0, width, height}, [&](int y) {
        const std::vector<Sums> columns = column_sums(width, height, y, channel);
        for (int x = 0; x < width; ++x) {
            Sums all;
            const int first = std::max(0, x - Neighbourhood::radius),
                      last = std::min(width - 1, x + Neighbourhood::radius);
            for (int column = first; column <= last; ++column) all.add(columns[size_t(column)]);
            const size_t i = size_t(y) * size_t(width) + size_t(x);
            const double mean = double(channel.mean[i]), variance = double(channel.variance[i]);
            Neighbourhood around;
            around.count = all.count - 1;
            around.means = all.means - mean;
            around.squares = all.squares - mean * mean;
            around.variances = all.variances - variance;
            const ErrorBase base = error_base(mean, variance, around);
            bases.likely[i] = float(base.likely);
            bases.cautious[i] = float(base.cautious);
            const bool hangs_on_one = std::sqrt(variance) > near_mean * std::abs(mean);
            bases.dark[i] = hangs_on_one ? std::min(bases.likely[i],
                                                    lower_quarter(channel, width, height, x, y))
                                         : bases.likely[i];
        }
    });
    return bases;
}

std::array<ErrorBases, 3> error_bases(int width, int height, const NoisyPicture& picture) {
    return {error_bases(width, height, picture[0]), error_bases(width, height, picture[1]),
            error_bases(width, height, picture[2])};
}

void PictureErrorSum::add(int width,
                          int top,
                          int first,
                          int end,
                          const NoisyPicture& strip,
                          const std::array<ErrorBases, 3>& bases) {
    bins_.resize(bin_count);
    const Window picture{0, 0, width, top + end};
    for (int row = first; row < end; ++row) {
        for (int x = 0; x < width; ++x) {
            const size_t i = size_t(row) * size_t(width) + size_t(x),
                         set = interleaved_set(picture, x, top + row);
            const double likely = relative_of(strip, bases, &ErrorBases::likely, i),
                         dark = relative_of(strip, bases, &ErrorBases::dark, i);
            likely_[set] += likely;
            cautious_[set] += relative_of(strip, bases, &ErrorBases::cautious, i);
            dark_[set] += dark;
            counts_[set] += 3;
            sum_of_squares_ += likely * likely;
            Bin& bin = bins_[bin_of(dark)];
            ++bin.count;
            bin.sum += dark;
        }
    }
}

void PictureErrorSum::add(const PictureErrorSum& other) {
    for (size_t set = 0; set < interleaved_sets; ++set) {
        likely_[set] += other.likely_[set];
        cautious_[set] += other.cautious_[set];
        dark_[set] += other.dark_[set];
        counts_[set] += other.counts_[set];
    }
    sum_of_squares_ += other.sum_of_squares_;
    bins_.resize(bin_count);
    for (size_t i = 0; i < other.bins_.size(); ++i) {
        bins_[i].count += other.bins_[i].count;
        bins_[i].sum += other.bins_[i].sum;
    }
}

/// How many of the largest squares make half of their sum.
size_t PictureErrorSum::half_in() const {
    double all = 0;
    for (const Bin& bin : bins_) all += bin.sum;
    double left = 0.5 * all;
    size_t count = 0;
    for (auto bin = bins_.rbegin(); bin != bins_.rend() && left > 0; ++bin) {
        if (bin->count == 0) continue;
        if (bin->sum >= left)
            return count +
                   std::max<size_t>(size_t(std::lround(left * double(bin->count) / bin->sum)), 1);
        left -= bin->sum;
        count += bin->count;
    }
    return count;
}

RelativeError PictureErrorSum::result() const {
    RelativeError stated = error_of(likely_, counts_);
    const RelativeError cautious = error_of(cautious_, counts_), dark = error_of(dark_, counts_);
    const double pixels = std::accumulate(counts_.begin(), counts_.end(), 0.0) / 3;
    constexpr double agreement = 1.1, darkest = 1.3;
    stated.is_lower = stated.value > agreement * cautious.value ||
                      dark.value > darkest * stated.value ||
                      few_pixels(3 * pixels * stated.value * stated.value, sum_of_squares_, pixels);
    if (!stated.is_lower) return stated;
    // No step where bases begin to disagree: a search for a target goes by the figure
    const double share = std::min(1.0, agreement * cautious.value / stated.value);
    for (double* part : {&stated.value, &stated.low, &stated.high}) *part *= share;
    stated.half_in = half_in();
    return stated;
}

std::optional<RelativeError> picture_error(const Window& window, const FillRow& fill) {
    constexpr int rows = 64, radius = Neighbourhood::radius;
    const int width = window.width(), height = std::max(window.height(), 0);
    std::vector<PictureErrorSum> strips(size_t((height + rows - 1) / rows));
    std::atomic<bool> is_known = true;
    parallel_for(strips.size(), [&](size_t s) {
        const int first = int(s) * rows, end = std::min(first + rows, height);
        const int top = std::max(first - radius, 0), bottom = std::min(end + radius, height);
        NoisyPicture strip;
        for (NoisyChannel& channel : strip) {
            channel.mean.resize(size_t(width) * size_t(bottom - top));
            channel.variance.resize(channel.mean.size());
        }
        for (int y = top; y < bottom; ++y) {
            if (!is_known.load(std::memory_order_relaxed)) return;
            if (!fill(window.y0 + y, size_t(y - top) * size_t(width), strip)) is_known = false;
        }
        strips[s].add(width, top, first - top, end - top, strip,
                      error_bases(width, bottom - top, strip));
    });
    if (!is_known) return std::nullopt;
    PictureErrorSum sum;
    for (const PictureErrorSum& strip : strips) sum.add(strip);
    return sum.result();
}

RelativeError picture_error(int width, int height, const NoisyPicture& picture) {
    const auto copy_row = [&](int y, size_t at, NoisyPicture& strip) {
        const size_t from = size_t(y) * size_t(width);
        for (size_t c = 0; c < 3; ++c) {
            std::copy_n(&picture[c].mean[from], width, &strip[c].mean[at]);
            std::copy_n(&picture[c].variance[from], width, &strip[c].variance[at]);
        }
        return true;
    };
    return *picture_error({0, 0, width, height}, copy_row);
}

}  // namespace velatura::image
