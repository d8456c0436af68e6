// SPDX-License-Identifier: Apache-2.0
#include "statistics/image_error.h"

#include "base/tasks.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>

namespace velatura::statistics {

namespace {

/// Sums down a column of a neighborhood, or over such columns.
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
    const int first = std::max(0, y - Neighborhood::radius),
              last = std::min(height - 1, y + Neighborhood::radius);
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
double relative_of(const NoisyImage& image,
                   const std::array<ErrorBases, 3>& bases,
                   std::vector<float> ErrorBases::*which,
                   size_t i) {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c)
        sum += relative_square(double(image[c].variance[i]), double((bases[c].*which)[i]));
    return sum;
}

RelativeError error_of(const std::array<double, accumulate::interleaved_sets>& squares,
                       const std::array<double, accumulate::interleaved_sets>& counts) {
    RelativeErrorSum sum;
    for (size_t set = 0; set < accumulate::interleaved_sets; ++set)
        sum.add_tile(squares[set], counts[set]);
    return sum.result();
}

/// What a quarter of the means around a pixel are below.
float lower_quarter(const NoisyChannel& channel, int width, int height, int x, int y) {
    constexpr int radius = Neighborhood::radius;
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

/// Of a figure that is known to ±10 %.
constexpr double largest_excess = 1.1;

/// A pixel that met one sample of a thing of radiance L beside the dark q has an unknown part x/n
/// of it, n samples, x a Poisson mean: without other knowledge of density x e^−x. Its true relative
/// square, (1 − x)² / (x² + ε²) with ε = n q / L, has the second moment ∫ x e^−x (1 − x)⁴ / (x² +
/// ε²)² dx, at most 1 / (2 ε²): half of its square by the dark base, 1 / ε². Of the sum of three
/// channels that is 3/2.
constexpr double of_unknown_coverage = 1.5;

/// The variance of the square s of normal noise of deviation σ, 2 σ⁴, over its second moment 3 σ⁴.
constexpr double of_normal_noise = 2.0 / 3;

constexpr size_t bin_bits = 18, bin_count = size_t(1) << (31 - bin_bits);

/// Of a square, which has no sign.
size_t bin_of(double square) {
    return std::bit_cast<uint32_t>(float(square)) >> bin_bits;
}

}  // namespace

ErrorBase error_base(double mean, double variance, const Neighborhood& around) {
    if (!(variance > 0) || around.count == 0) return {mean, mean};
    const double middle = around.means / around.count;
    const double spread = std::max(0.0, around.squares / around.count - middle * middle);
    const double signal = std::max(0.0, spread - around.variances / around.count);
    const double blend = middle + signal / (signal + variance) * (mean - middle);
    const double reach = 2 * std::sqrt(variance);
    const double likely = std::clamp(blend, mean - reach, mean + reach);
    constexpr double far = 3;  // standard deviations of what is around
    const bool is_outlier = mean > middle + far * std::sqrt(spread);
    return {likely, is_outlier ? middle : mean};
}

ErrorBases error_bases(int width, int height, const NoisyChannel& channel) {
    const size_t pixels = channel.mean.size();
    ErrorBases bases{std::vector<float>(pixels), std::vector<float>(pixels),
                     std::vector<float>(pixels)};
    // The mean square of k samples' halves is 1/k: two are 0.7²
    constexpr double near_mean = 0.7;
    accumulate::for_each_row({0, 0, width, height}, [&](int y) {
        const std::vector<Sums> columns = column_sums(width, height, y, channel);
        for (int x = 0; x < width; ++x) {
            Sums all;
            const int first = std::max(0, x - Neighborhood::radius),
                      last = std::min(width - 1, x + Neighborhood::radius);
            for (int column = first; column <= last; ++column) all.add(columns[size_t(column)]);
            const size_t i = size_t(y) * size_t(width) + size_t(x);
            const double mean = double(channel.mean[i]), variance = double(channel.variance[i]);
            Neighborhood around;
            around.count = all.count - 1;
            around.means = all.means - mean;
            around.squares = all.squares - mean * mean;
            around.variances = all.variances - variance;
            const ErrorBase base = error_base(mean, variance, around);
            bases.likely[i] = float(base.likely);
            bases.beside[i] = float(base.beside);
            const bool hangs_on_one = std::sqrt(variance) > near_mean * std::abs(mean);
            bases.dark[i] = hangs_on_one ? std::min(bases.likely[i],
                                                    lower_quarter(channel, width, height, x, y))
                                         : bases.likely[i];
        }
    });
    return bases;
}

std::array<ErrorBases, 3> error_bases(int width, int height, const NoisyImage& image) {
    return {error_bases(width, height, image[0]), error_bases(width, height, image[1]),
            error_bases(width, height, image[2])};
}

void ImageErrorSum::add(int width,
                        int top,
                        int first,
                        int end,
                        const NoisyImage& strip,
                        const std::array<ErrorBases, 3>& bases) {
    bins_.resize(bin_count);
    const image::Window image{0, 0, width, top + end};
    for (int row = first; row < end; ++row) {
        for (int x = 0; x < width; ++x) {
            const size_t i = size_t(row) * size_t(width) + size_t(x),
                         set = accumulate::interleaved_set(image, x, top + row);
            const double likely = relative_of(strip, bases, &ErrorBases::likely, i),
                         dark = relative_of(strip, bases, &ErrorBases::dark, i);
            likely_[set] += likely;
            counts_[set] += 3;
            variance_ += dark > likely ? std::max(likely * likely, of_unknown_coverage * dark)
                                       : of_normal_noise * likely * likely;
            add_outlier(strip, bases, i);
            Bin& bin = bins_[bin_of(dark)];
            ++bin.count;
            bin.sum += dark;
            if (dark > worst_) {
                worst_ = dark;
                worst_x_ = x;
                worst_y_ = top + row;
            }
        }
    }
}

void ImageErrorSum::add_outlier(const NoisyImage& strip,
                                const std::array<ErrorBases, 3>& bases,
                                size_t i) {
    double darker = 0;
    for (size_t c = 0; c < 3; ++c) {
        const double mean = double(strip[c].mean[i]), beside = double(bases[c].beside[i]);
        if (!(beside < mean)) continue;
        const double variance = double(strip[c].variance[i]), apart = std::sqrt(variance),
                     likely = double(bases[c].likely[i]),
                     by_likely = relative_square(variance, likely);
        const double brighter = mean + apart - beside;
        outliers_.brighter += brighter;
        darker += mean - apart - beside;
        const auto change = [&](double base) {
            return relative_square(variance, std::max(base, likely)) - by_likely;
        };
        constexpr double all = (2 * Neighborhood::radius + 1) * (2 * Neighborhood::radius + 1);
        for (int step = 0; step <= Outliers::steps; ++step)
            outliers_.change[size_t(step)] +=
                change(beside + std::max(brighter * step / Outliers::steps, (mean - beside) / all));
        outliers_.own_change += change(mean);
    }
    outliers_.darker += darker;
    outliers_.darker_squares += darker * darker;
}

size_t ImageErrorSum::Outliers::step() const {
    if (!(brighter > 0)) return 0;
    const double share = (darker + 2 * std::sqrt(darker_squares)) / brighter;
    return size_t(std::ceil(std::clamp(share, 0.0, 1.0) * steps));
}

void ImageErrorSum::add(const ImageErrorSum& other) {
    for (size_t set = 0; set < accumulate::interleaved_sets; ++set) {
        likely_[set] += other.likely_[set];
        counts_[set] += other.counts_[set];
    }
    outliers_.brighter += other.outliers_.brighter;
    outliers_.darker += other.outliers_.darker;
    outliers_.darker_squares += other.outliers_.darker_squares;
    for (size_t i = 0; i < outliers_.change.size(); ++i)
        outliers_.change[i] += other.outliers_.change[i];
    outliers_.own_change += other.outliers_.own_change;
    variance_ += other.variance_;
    if (other.worst_ > worst_) {
        worst_ = other.worst_;
        worst_x_ = other.worst_x_;
        worst_y_ = other.worst_y_;
    }
    bins_.resize(bin_count);
    for (size_t i = 0; i < other.bins_.size(); ++i) {
        bins_[i].count += other.bins_[i].count;
        bins_[i].sum += other.bins_[i].sum;
    }
}

/// How many of the largest squares make half of their sum.
size_t ImageErrorSum::half_in() const {
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

RelativeError ImageErrorSum::result() const {
    RelativeError stated = error_of(likely_, counts_);
    const double count = std::accumulate(counts_.begin(), counts_.end(), 0.0),
                 sum = std::accumulate(likely_.begin(), likely_.end(), 0.0);
    // Roots of sums over that of the stated one
    const auto by = [&](double change) {
        return sum > 0 ? std::sqrt(std::max(0.0, sum + change) / sum) : 1;
    };
    const double cautious = by(outliers_.change[outliers_.step()]), own = by(outliers_.own_change);
    stated.is_lower = largest_excess * cautious < 1 || few_pixels(sum, variance_, count / 3);
    if (!stated.is_lower) return stated;
    // No step where bases begin to disagree: a search for a target goes by the figure
    const double doubt = std::clamp(
        (1 / (largest_excess * std::max(cautious, 1e-9)) - 1) / (largest_excess - 1), 0.0, 1.0);
    const double share = 1 - doubt * (1 - std::min(1.0, largest_excess * own));
    for (double* part : {&stated.value, &stated.low, &stated.high}) *part *= share;
    stated.half_in = half_in();
    stated.worst_x = worst_x_;
    stated.worst_y = worst_y_;
    return stated;
}

std::optional<RelativeError> image_error(const image::Window& window, const FillRow& fill) {
    constexpr int rows = 64, radius = Neighborhood::radius;
    const int width = window.width(), height = std::max(window.height(), 0);
    std::vector<ImageErrorSum> strips(size_t((height + rows - 1) / rows));
    std::atomic<bool> is_known = true;
    parallel_for(strips.size(), [&](size_t s) {
        const int first = int(s) * rows, end = std::min(first + rows, height);
        const int top = std::max(first - radius, 0), bottom = std::min(end + radius, height);
        NoisyImage strip;
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
    ImageErrorSum sum;
    for (const ImageErrorSum& strip : strips) sum.add(strip);
    RelativeError error = sum.result();
    if (error.worst_x >= 0) {
        error.worst_x += window.x0;
        error.worst_y += window.y0;
    }
    return error;
}

RelativeError image_error(int width, int height, const NoisyImage& image) {
    const auto copy_row = [&](int y, size_t at, NoisyImage& strip) {
        const size_t from = size_t(y) * size_t(width);
        for (size_t c = 0; c < 3; ++c) {
            std::copy_n(&image[c].mean[from], width, &strip[c].mean[at]);
            std::copy_n(&image[c].variance[from], width, &strip[c].variance[at]);
        }
        return true;
    };
    return *image_error({0, 0, width, height}, copy_row);
}

}  // namespace velatura::statistics
