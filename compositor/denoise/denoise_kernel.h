// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/denoise/denoise_guides.h"

#include <array>
#include <span>
#include <vector>

namespace velatura::compositor::denoise {

/// One way to weigh neighbors.
struct DenoiseFilter {
    float color_width = 1;        ///< standard deviations of noise that patches may differ by
    float feature_width = 1;      ///< differences of features, in units of their scale
    bool is_first_order = false;  ///< weighted regression on the features; else a weighted mean
};

/// Weights of the neighbors of a tile's pixels, from one half image and the features. The square
/// window around pixel p has `side`² neighbors; weights are [neighbor][pixel of the tile] and add
/// up to 1 per pixel. Outside the image they are 0.
///
/// Ref: Buades, Coll, Morel 2005 (non-local means); Rousselle, Knaus, Zwicker 2012 and 2013
/// (distances less their noise, dual buffers, feature weights); Bitterli et al. 2016 (first-order
/// regression weighted by non-local means).
class DenoiseKernel {
  public:
    static constexpr int tile_size = 32;
    static constexpr int radius = 9, patch_radius = 3;
    static constexpr int side = 2 * radius + 1;
    static constexpr int neighbors = side * side;
    static constexpr int halo = radius + patch_radius;
    static constexpr int padded = tile_size + 2 * halo;
    static constexpr size_t tile_pixels = size_t(tile_size) * size_t(tile_size);
    using Weights = std::vector<float>;  // [neighbors][tile_size][tile_size]

    explicit DenoiseKernel(const DenoiseGuides& guides);

    /// Takes the tile whose top left pixel is (x, y) of the window, counted from its corner.
    void move_to(int x, int y);

    /// half: 0 = A, 1 = B.
    void find_weights(int half, const DenoiseFilter& filter, Weights& weights);

    /// Σ_q w_pq plane(q) for the pixels of the tile. padded_plane: of copy_padded; out
    /// [tile_size]².
    static void apply(const Weights& weights, const float* padded_plane, float* out);

    /// The tile with `halo` pixels around, the image's edge repeated; f(pixel of the window).
    template <class F>
    void copy_padded(F value, float* out) const {
        for (int y = 0; y < padded; ++y) {
            for (int x = 0; x < padded; ++x) *out++ = value(source_[size_t(y * padded + x)]);
        }
    }

  private:
    void find_color_distances(int half);
    void find_feature_distances();
    void weigh_by_distances(int half, const DenoiseFilter& filter, Weights& weights) const;
    void normalize(Weights& weights) const;
    void regress(Weights& weights) const;

    const DenoiseGuides& guides_;
    std::vector<size_t> source_;                         ///< [padded]²: pixel of the window
    std::vector<float> is_inside_;                       ///< [padded]²: 1 in the image, 0 outside
    std::vector<std::vector<float>> features_;           ///< [feature][padded]²
    std::array<std::vector<float>, 2> color_distances_;  ///< [half][neighbors][tile]
    std::vector<float> feature_distances_;               ///< [neighbors][tile]
};

}  // namespace velatura::compositor::denoise
