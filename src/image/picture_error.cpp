// SPDX-License-Identifier: Apache-2.0
#include "image/picture_error.h"

#include "image/pixel_means.h"

#include <algorithm>
#include <functional>

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

/// What the pixels of some rows sum to.
struct RowSums {
    /// By the set that pixels are dealt to.
    std::array<double, interleaved_sets> likely{}, cautious{}, dark{}, counts{};
    double sum_of_squares = 0;  ///< of pixels, by the likely bases

    void add(const RowSums& r) {
        for (size_t set = 0; set < interleaved_sets; ++set) {
            likely[set] += r.likely[set];
            cautious[set] += r.cautious[set];
            dark[set] += r.dark[set];
            counts[set] += r.counts[set];
        }
        sum_of_squares += r.sum_of_squares;
    }
};

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

/// How many of the largest values make half of their sum.
size_t count_half(std::vector<double> values) {
    std::sort(values.begin(), values.end(), std::greater<>());
    double all = 0, so_far = 0;
    for (const double v : values) all += v;
    size_t count = 0;
    while (count < values.size() && so_far < 0.5 * all) so_far += values[count++];
    return count;
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

RelativeError picture_error(int width,
                            int height,
                            const NoisyPicture& picture,
                            const std::array<ErrorBases, 3>& bases) {
    const Window w{0, 0, width, height};
    std::vector<RowSums> rows(size_t(std::max(height, 0)));
    for_each_row(w, [&](int y) {
        RowSums& row = rows[size_t(y)];
        for (int x = 0; x < width; ++x) {
            const size_t i = w.index(x, y), set = interleaved_set(w, x, y);
            const double likely = relative_of(picture, bases, &ErrorBases::likely, i);
            row.likely[set] += likely;
            row.cautious[set] += relative_of(picture, bases, &ErrorBases::cautious, i);
            row.dark[set] += relative_of(picture, bases, &ErrorBases::dark, i);
            row.counts[set] += 3;
            row.sum_of_squares += likely * likely;
        }
    });
    RowSums all;
    for (const RowSums& row : rows) all.add(row);
    const RelativeError likely = error_of(all.likely, all.counts);
    RelativeError cautious = error_of(all.cautious, all.counts);
    const auto pixels = double(w.pixel_count());
    const RelativeError dark = error_of(all.dark, all.counts);
    constexpr double agreement = 1.1, darkest = 1.3;
    if (!few_pixels(3 * pixels * likely.value * likely.value, all.sum_of_squares, pixels) &&
        likely.value <= agreement * cautious.value && dark.value <= darkest * likely.value)
        return likely;
    cautious.is_lower = true;
    std::vector<double> squares(w.pixel_count());
    for (size_t i = 0; i < squares.size(); ++i)
        squares[i] = relative_of(picture, bases, &ErrorBases::dark, i);
    cautious.half_in = count_half(std::move(squares));
    return cautious;
}

RelativeError picture_error(int width, int height, const NoisyPicture& picture) {
    std::array<ErrorBases, 3> bases;
    for (size_t c = 0; c < 3; ++c) bases[c] = error_bases(width, height, picture[c]);
    return picture_error(width, height, picture, bases);
}

}  // namespace velatura::image
