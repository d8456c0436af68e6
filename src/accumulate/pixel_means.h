// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace velatura::accumulate {

/// The mean of a pixel and its two halves.
struct PixelHalves {
    std::array<double, 3> mean{}, a{}, b{};
    std::array<double, 3> variance{};  ///< of the mean, estimated from the difference of the halves
    bool is_known = false;             ///< both halves have samples
};

/// What the sums are divided by: the sum of the filter weights, or the number of valid samples
/// (mean weight 1) where weights of both signs cancel to less than a tenth of it.
double weight_of(const Triple& coverage);

/// The mean of samples with these sums; black without a valid sample.
EarlierMean mean_of(const Triple& sum, const Triple& coverage);

/// What the even ones leave; exact zero stays exact zero.
Triple odd_samples(const Triple& all, const Triple& even);

PixelHalves resolve_halves(const SampleSums& sums, int x, int y, uint32_t accumulator);

/// The independent beauty and alpha, [height][width][4].
std::vector<float> resolve_rgba(const SampleSums& sums);

/// Share of all light that clamps took; 0 without any.
double clamped_share(const SampleSums& sums);

/// Pixels are dealt to so many sets, neighbors to different ones: these see the same image and
/// differ by its noise.
inline constexpr size_t interleaved_sets = 16;

/// Of a pixel of the window, in [0, interleaved_sets).
inline size_t interleaved_set(const image::Window& w, int x, int y) {
    return size_t((x - w.x0) + 5 * (y - w.y0)) % interleaved_sets;
}

/// Calls body(y), several rows at the same time.
void for_each_row(const image::Window& w, const std::function<void(int)>& body);

}  // namespace velatura::accumulate
