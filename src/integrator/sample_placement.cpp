// SPDX-License-Identifier: Apache-2.0
#include "integrator/sample_placement.h"

#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace velatura::integrator {

namespace {

/// A Gaussian of 1.7 pixels: 36 pixels tell as much as they do with equal weights, and edges of
/// shadows stay narrow.
constexpr std::array<float, 5> weights = {1.0f, 0.8411f, 0.5005f, 0.2107f, 0.0627f};
constexpr int reach = int(weights.size()) - 1;

/// Calls `use(at, weight)` for all places at most `reach` from `center` that a line of `size` has.
template <class Use>
void for_each_near(int center, int size, const Use& use) {
    for (int at = std::max(0, center - reach); at <= std::min(size - 1, center + reach); ++at)
        use(at, weights[size_t(std::abs(at - center))]);
}

/// Base 2 logarithms of merits and of what is divided by them, in steps.
constexpr int steps_per_octave = 32;
constexpr int lowest_step = -40 * steps_per_octave, highest_step = 8 * steps_per_octave;
constexpr int no_noise = std::numeric_limits<int>::min() / 2;

int step_of(float merit) {
    if (!(merit > 0)) return no_noise;
    return int(std::clamp(std::lround(steps_per_octave * std::log2(double(merit))),
                          long(lowest_step), long(highest_step)));
}

/// Base 2 logarithm of merit / unit, rounded and in range; no noise has the lowest.
int exponent_of(int merit, int unit) {
    return std::clamp(
        (merit - unit + steps_per_octave / 2) >> std::countr_zero(unsigned(steps_per_octave)),
        SampleRates::lowest, SampleRates::highest);
}

/// A rate in multiples of the lowest.
int64_t multiple(int exponent) {
    return int64_t(1) << (exponent - SampleRates::lowest);
}

/// Sums of all pixels' rates, in multiples of the lowest, by unit.
class RateSums {
  public:
    explicit RateSums(const std::vector<int>& merits) : sums_(size_t(units), 0) {
        // From the largest unit on, where all are lowest, each pixel gains at the first unit for
        // each rate
        for (const int merit : merits) {
            if (merit == no_noise) continue;
            for (int e = SampleRates::lowest + 1; e <= SampleRates::highest; ++e)
                sums_[index(merit + steps_per_octave / 2 - e * steps_per_octave)] +=
                    multiple(e) - multiple(e - 1);
        }
        for (size_t i = sums_.size() - 1; i-- > 0;) sums_[i] += sums_[i + 1];
        for (int64_t& sum : sums_) sum += int64_t(merits.size());
    }

    int64_t at(int unit) const { return sums_[index(unit)]; }

    /// So small that whatever has noise has the highest rate, and so large that nothing has more
    /// than the lowest.
    static constexpr int smallest_unit = lowest_step - 4 * steps_per_octave,
                         largest_unit = highest_step + 3 * steps_per_octave;

  private:
    static constexpr int units = largest_unit - smallest_unit + 1;

    static size_t index(int unit) { return size_t(unit - smallest_unit); }

    std::vector<int64_t> sums_;
};

constexpr int tile_size = 4;  // pixels that share a unit

/// Rates of the pixels of a tile, whose mean is 1 together with the rates by the same unit of all
/// pixels that the samples of this tile have nothing to do with.
void place_tile(const film::Window& window,
                const film::Window& tile,
                const std::vector<int>& merits,
                const RateSums& sums,
                std::vector<int8_t>& exponents) {
    const film::Window near = {
        std::max(tile.x0 - reach, window.x0), std::max(tile.y0 - reach, window.y0),
        std::min(tile.x1 + reach, window.x1), std::min(tile.y1 + reach, window.y1)};
    const int64_t far_pixels = int64_t(window.pixel_count()) - int64_t(near.pixel_count());
    const auto far_sum = [&](int unit) {
        int64_t sum = sums.at(unit);
        for (int y = near.y0; y < near.y1; ++y) {
            for (int x = near.x0; x < near.x1; ++x)
                sum -= multiple(exponent_of(merits[window.index(x, y)], unit));
        }
        return sum;
    };
    // The smallest unit by which they are not more than 1 in the mean
    int below = RateSums::smallest_unit - 1, unit = RateSums::largest_unit;
    while (unit - below > 1) {
        const int middle = (unit + below) >> 1;
        (far_sum(middle) > multiple(0) * far_pixels ? below : unit) = middle;
    }
    const bool is_alone = far_pixels == 0,
               is_noise_elsewhere = far_sum(RateSums::smallest_unit) > far_pixels;
    for (int y = tile.y0; y < tile.y1; ++y) {
        for (int x = tile.x0; x < tile.x1; ++x) {
            const size_t at = window.index(x, y);
            const bool stays = is_alone || (merits[at] == no_noise && !is_noise_elsewhere);
            exponents[at] = int8_t(stays ? 0 : exponent_of(merits[at], unit));
        }
    }
}

}  // namespace

std::vector<float> mean_around(const std::vector<float>& values, int width, int height) {
    // Sums along rows first, with the pixel in the middle and without
    std::vector<float> rows(values.size()), rows_without(values.size()), means(values.size());
    parallel_for(size_t(height), [&](size_t y) {
        const size_t row = y * size_t(width);
        for (int x = 0; x < width; ++x) {
            float sum = 0;
            for_each_near(x, width, [&](int at, float weight) {
                sum += at == x ? 0.0f : weight * values[row + size_t(at)];
            });
            rows_without[row + size_t(x)] = sum;
            rows[row + size_t(x)] = sum + values[row + size_t(x)];
        }
    });
    const auto total_weight = [](int center, int size) {
        float sum = 0;
        for_each_near(center, size, [&](int, float weight) { sum += weight; });
        return sum;
    };
    parallel_for(size_t(height), [&](size_t row) {
        const int y = int(row);
        const float column_weight = total_weight(y, height);
        for (int x = 0; x < width; ++x) {
            const size_t at = row * size_t(width) + size_t(x);
            float sum = 0;
            for_each_near(y, height, [&](int i, float weight) {
                sum += i == y ? rows_without[at]
                              : weight * rows[size_t(i) * size_t(width) + size_t(x)];
            });
            const float weight = column_weight * total_weight(x, width) - 1;
            means[at] = weight > 0 ? sum / weight : 0.0f;
        }
    });
    return means;
}

PilotNoise::PilotNoise(const film::Window& window)
    : window_(window), pixels_(size_t(window.pixel_count())) {}

void PilotNoise::add(int x, int y, const Rgb& value, uint64_t rays) {
    Pixel& pixel = pixels_[index(x, y)];
    float* sum = pixel.sum[pixel.samples++ * runs / pilot_samples];
    for (int c = 0; c < 3; ++c) sum[c] += value[c];
    pixel.rays += uint32_t(rays);
}

double PilotNoise::merit(int x, int y) const {
    const Pixel& pixel = pixels_[index(x, y)];
    constexpr double per_run = double(pilot_samples) / double(runs);
    double error = 0;
    for (size_t c = 0; c < 3; ++c) {
        double mean = 0, spread = 0;
        for (const auto& sum : pixel.sum) mean += double(sum[c]) / double(pilot_samples);
        for (const auto& sum : pixel.sum) spread += sqr(double(sum[c]) / per_run - mean);
        error += spread / double(runs - 1) / (mean * mean + 0.01);
    }
    // A sample costs something beside its rays
    const double cost = 1.0 + double(pixel.rays) / double(pilot_samples);
    const double merit = std::sqrt(error / cost);
    return std::isfinite(merit) ? merit : 0.0;
}

std::vector<float> PilotNoise::merits() const {
    std::vector<float> merits(window_.pixel_count());
    parallel_for(size_t(window_.height()), [&](size_t row) {
        const int y = window_.y0 + int(row);
        for (int x = window_.x0; x < window_.x1; ++x) merits[index(x, y)] = float(merit(x, y));
    });
    return merits;
}

SampleRates::SampleRates(const PilotNoise& noise)
    : SampleRates(noise.window(),
                  mean_around(noise.merits(), noise.window().width(), noise.window().height())) {}

SampleRates::SampleRates(const film::Window& window, const std::vector<float>& merits)
    : window_(window) {
    if (std::none_of(merits.begin(), merits.end(), [](float merit) { return merit > 0; })) return;
    std::vector<int> steps(merits.size());
    std::transform(merits.begin(), merits.end(), steps.begin(), step_of);
    const RateSums sums(steps);
    exponents_.resize(merits.size());
    const int columns = (window.width() + tile_size - 1) / tile_size,
              rows = (window.height() + tile_size - 1) / tile_size;
    parallel_for(size_t(rows), [&](size_t row) {
        for (int column = 0; column < columns; ++column) {
            const int x = window.x0 + column * tile_size, y = window.y0 + int(row) * tile_size;
            place_tile(
                window,
                {x, y, std::min(x + tile_size, window.x1), std::min(y + tile_size, window.y1)},
                steps, sums, exponents_);
        }
    });
}

std::optional<SampleRates> SampleRates::kept_in(const film::Film& film) {
    SampleRates rates;
    rates.window_ = film.window();
    const film::Window& w = rates.window_;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const int exponent = int(film.sums().record(x, y).rate) - rate_of_1;
            if (exponent < lowest || exponent > highest) return std::nullopt;
            rates.exponents_.push_back(int8_t(exponent));
        }
    }
    return rates;
}

void SampleRates::keep_in(film::Film& film) const {
    const film::Window& w = film.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x)
            film.set_rate(x, y, uint8_t(rate_of_1 + exponent_at(x, y)));
    }
}

int SampleRates::exponent_at(int x, int y) const {
    return is_uniform() ? 0
                        : exponents_[size_t(y - window_.y0) * size_t(window_.width()) +
                                     size_t(x - window_.x0)];
}

LightPasses SampleRates::light_passes(int x, int y, uint64_t sample) const {
    const int exponent = is_uniform() ? 0 : exponent_at(x, y);
    if (exponent == 0 || sample < pilot_samples) return {sample, 1, sample, sample + 1};
    const uint64_t odd = sample & 1;
    if (exponent > 0) {
        const uint64_t begin = (sample >> (exponent + 1)) << 1;
        return {begin + odd, 1, begin, begin + 2};
    }
    const int less = -exponent;
    const uint64_t begin = (sample >> 1) << (less + 1);
    return {begin + odd, uint64_t(1) << less, begin, begin + (uint64_t(2) << less)};
}

uint64_t SampleRates::count(int x, int y, uint64_t index) const {
    if (is_uniform() || index <= pilot_samples) return index;
    const int exponent = exponent_at(x, y);
    const uint64_t count =
        exponent >= 0 ? index << exponent : (index + (uint64_t(1) << -exponent) - 1) >> -exponent;
    return std::max(count, pilot_samples);
}

TopUpCounts::TopUpCounts(const film::Film& film, std::vector<uint64_t> wanted, uint64_t steps)
    : window_(film.window()), wanted_(std::move(wanted)), steps_(std::max<uint64_t>(steps, 1)) {
    present_.reserve(wanted_.size());
    for (int y = window_.y0; y < window_.y1; ++y) {
        for (int x = window_.x0; x < window_.x1; ++x) present_.push_back(film.next_sample(x, y));
    }
    for (size_t i = 0; i < wanted_.size(); ++i) wanted_[i] = std::max(wanted_[i], present_[i]);
}

uint64_t TopUpCounts::count(int x, int y, uint64_t index) const {
    const size_t i = window_.index(x, y);
    return present_[i] + (wanted_[i] - present_[i]) * std::min(index, steps_) / steps_;
}

}  // namespace velatura::integrator
