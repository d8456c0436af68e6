// SPDX-License-Identifier: Apache-2.0
#include "integrator/sample_placement.h"

#include <algorithm>
#include <cmath>

#include "base/tasks.h"

namespace velatura::integrator {

namespace {

constexpr int neighbourhood = 3;  // pixels to each side: 48 of them tell enough, and edges of shadows stay narrow

/// Mean of the values within `neighbourhood` of each pixel, that of the pixel itself left out.
std::vector<float> mean_around(const std::vector<float>& values, int width, int height) {
    // Sums of rows first
    std::vector<float> rows(values.size()), means(values.size());
    parallel_for(size_t(height), [&](size_t y) {
        const float* row = &values[y * size_t(width)];
        for (int x = 0; x < width; ++x) {
            float sum = 0;
            for (int i = std::max(0, x - neighbourhood); i <= std::min(width - 1, x + neighbourhood); ++i) sum += row[i];
            rows[y * size_t(width) + size_t(x)] = sum;
        }
    });
    parallel_for(size_t(height), [&](size_t row) {
        const int y = int(row), first = std::max(0, y - neighbourhood), last = std::min(height - 1, y + neighbourhood);
        for (int x = 0; x < width; ++x) {
            const int columns = std::min(width - 1, x + neighbourhood) - std::max(0, x - neighbourhood) + 1;
            const size_t at = row * size_t(width) + size_t(x);
            float sum = 0;
            for (int i = first; i <= last; ++i) sum += rows[size_t(i) * size_t(width) + size_t(x)];
            const int count = columns * (last - first + 1) - 1;
            means[at] = count > 0 ? std::max(0.0f, sum - values[at]) / float(count) : values[at];
        }
    });
    return means;
}

/// Rounds merit / unit to a power of two in range; merit may be zero.
int exponent_of(float merit, double unit) {
    const double ratio = double(merit) / unit;
    if (!(ratio > 0)) return SampleRates::lowest;
    return std::clamp(int(std::lround(std::log2(ratio))), SampleRates::lowest, SampleRates::highest);
}

double mean_rate(const std::vector<float>& merits, double unit) {
    double sum = 0;
    for (const float m : merits) sum += std::ldexp(1.0, exponent_of(m, unit));
    return sum / double(merits.size());
}

}  // namespace

PilotNoise::PilotNoise(const film::Window& window) : window_(window), pixels_(size_t(window.pixel_count())) {}

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

SampleRates::SampleRates(const PilotNoise& noise) : window_(noise.window()) {
    const int width = window_.width(), height = window_.height();
    std::vector<float> merits(size_t(window_.pixel_count()));
    parallel_for(size_t(height), [&](size_t row) {
        for (int x = 0; x < width; ++x) merits[row * size_t(width) + size_t(x)] = float(noise.merit(window_.x0 + x, window_.y0 + int(row)));
    });
    merits = mean_around(merits, width, height);
    double most = 0;
    for (const float m : merits) most = std::max(most, double(m));
    if (!(most > 0)) return;

    // The merit that a rate of 1 stands for, so that the mean rate is 1: larger units make smaller rates
    double low = most * 0x1p-20, high = most * 0x1p4;
    for (int i = 0; i < 30; ++i) {
        const double middle = std::sqrt(low * high);
        (mean_rate(merits, middle) > 1.0 ? low : high) = middle;
    }
    exponents_.resize(merits.size());
    for (size_t i = 0; i < merits.size(); ++i) exponents_[i] = int8_t(exponent_of(merits[i], high));
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
        for (int x = w.x0; x < w.x1; ++x) film.set_rate(x, y, uint8_t(rate_of_1 + exponent_at(x, y)));
    }
}

int SampleRates::exponent_at(int x, int y) const {
    return is_uniform() ? 0 : exponents_[size_t(y - window_.y0) * size_t(window_.width()) + size_t(x - window_.x0)];
}

uint64_t SampleRates::count(int x, int y, uint64_t index) const {
    if (is_uniform() || index <= pilot_samples) return index;
    const int exponent = exponent_at(x, y);
    const uint64_t count = exponent >= 0 ? index << exponent : (index + (uint64_t(1) << -exponent) - 1) >> -exponent;
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
