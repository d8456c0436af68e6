// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "film/film.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::integrator {

/// Samples that every pixel gets before noise decides which gets more. Short renders are uniform.
inline constexpr uint64_t pilot_samples = 16;

/// What the pilot samples say about the noise and the cost of each pixel. Threads: as Film.
class PilotNoise {
  public:
    explicit PilotNoise(const film::Window& window);

    /// Adds the next sample of a pixel, one of its first pilot_samples: what it brought, filter
    /// weight included, and the rays that it took.
    void add(int x, int y, const Rgb& value, uint64_t rays);

    /// How many the pixel has. Samples come in their order, so that sums have the same bits however
    /// they were split.
    uint64_t next_sample(int x, int y) const { return pixels_[index(x, y)].samples; }

    const film::Window& window() const { return window_; }

    /// The relative standard error of a pixel's mean, √(variance / (mean² + 0.01)), divided by the
    /// square root of its cost: samples are best spent in proportion to it. From the spread of the
    /// means of four runs of four samples, so that what a low-discrepancy sequence integrates well
    /// counts little.
    double merit(int x, int y) const;

    /// Of all pixels, [height][width].
    std::vector<float> merits() const;

  private:
    static constexpr size_t runs = 4;

    struct Pixel {
        float sum[runs][3] = {};
        uint32_t rays = 0;
        uint32_t samples = 0;
    };

    size_t index(int x, int y) const {
        return size_t(y - window_.y0) * size_t(window_.width()) + size_t(x - window_.x0);
    }

    film::Window window_;
    std::vector<Pixel> pixels_;
};

/// Mean of the values around each pixel, [height][width], by a Gaussian of 1.7 pixels up to 4
/// pixels away. The pixel's own does not enter, not even by rounding.
std::vector<float> mean_around(const std::vector<float>& values, int width, int height);

/// Passes of light tracing: first, first + 2, …, `count` of them. All of a sample's, and those of
/// all samples before, are below `end`; those of all samples after are at `begin` or above.
struct LightPasses {
    uint64_t first = 0;
    uint64_t count = 1;
    uint64_t begin = 0, end = 1;
};

/// How many samples each pixel has when a pixel of rate 1 has `index`: the rate, a power of two
/// from 1/4 to 8, times as many, and never fewer than the pilot's. So whatever range of sample
/// indices is rendered, in whatever passes or parts, each pixel's samples are a run that the next
/// range continues.
///
/// A pixel's rate comes from the pilot samples of its neighbors, and their unit from pixels
/// further away, tile by tile; its own do not enter. So its samples are independent of how many
/// there are, and their mean is unbiased (docs/engineering/hard_cases.md H46: a pixel that has not
/// met the rare bright path yet must not be left alone for it).
class SampleRates {
  public:
    /// Every pixel the same.
    SampleRates() = default;

    /// Rates in proportion to the merit around each pixel, with mean 1.
    explicit SampleRates(const PilotNoise& noise);

    /// Rates in proportion to what mean_around made of merits, none of which is negative.
    SampleRates(const film::Window& window, const std::vector<float>& merits);

    /// The rates that a film keeps of an earlier part of the render; none unless every pixel has
    /// one.
    static std::optional<SampleRates> kept_in(const film::Film& film);

    /// Keeps the rates in a film of the same window, for later parts of the render.
    void keep_in(film::Film& film) const;

    bool is_uniform() const { return exponents_.empty(); }

    /// The passes of light tracing that a sample of a pixel gets. A pass is for every pixel that is
    /// sampled at rate 1; of those of higher rates several samples share one, and those of lower
    /// rates get the mean of several. Even samples get even passes alone, and odd ones odd passes.
    LightPasses light_passes(int x, int y, uint64_t sample) const;

    /// Samples of the pixel at `index`: its samples in [a, b) are [count(a), count(b)).
    uint64_t count(int x, int y, uint64_t index) const;

    /// No pixel has more samples than this at `index`.
    static uint64_t max(uint64_t index) {
        return index <= pilot_samples ? index : index << highest;
    }

    static constexpr int lowest = -2, highest = 3;  ///< base 2 logarithms of the rates

  private:
    static constexpr int rate_of_1 = 16;  ///< in the code that a film keeps; 0 stands for no rate

    int exponent_at(int x, int y) const;

    film::Window window_;
    std::vector<int8_t> exponents_;  ///< [height][width]
};

/// How many samples each pixel of a film has on the way to counts of its own: from those that it
/// came with to all that are wanted, evenly. Index 0 is the beginning and `steps` the end.
class TopUpCounts {
  public:
    /// wanted: [pixel of the window], where it is less than what is there nothing is added.
    TopUpCounts(const film::Film& film, std::vector<uint64_t> wanted, uint64_t steps);

    uint64_t count(int x, int y, uint64_t index) const;

  private:
    film::Window window_;
    std::vector<uint64_t> present_, wanted_;
    uint64_t steps_;
};

}  // namespace velatura::integrator
