// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise_choice.h"

#include "base/tasks.h"
#include "image/box_mean.h"

#include <algorithm>

namespace velatura::compositor::denoise {

namespace {

constexpr int T = DenoiseKernel::tile_size;
constexpr size_t center = size_t(DenoiseKernel::neighbors / 2);

/// Careful and bold regression, and a mean where the features say nothing (foliage, glass). Found
/// by trial over the scenes of docs/reference/denoise.md.
std::vector<DenoiseFilter> filters() {
    return {{0.5f, 1.0f, true}, {1.0f, 1.0f, true}, {1.0f, 2.0f, false}};
}

/// Calls f(pixel of the tile, pixel of the window) for those of the tile that are in the image.
template <class F>
void for_each_pixel(const image::Window& window, int x, int y, F f) {
    for (int v = y; v < std::min(y + T, window.height()); ++v) {
        for (int u = x; u < std::min(x + T, window.width()); ++u)
            f(size_t((v - y) * T + u - x), size_t(v) * size_t(window.width()) + size_t(u));
    }
}

/// A judged mix over a tile: as it is and as every filter makes it, per half and channel.
class TileJudge {
  public:
    TileJudge(const DenoiseGuides& guides, DenoiseKernel& kernel, int x, int y)
        : guides_(guides), kernel_(kernel), x_(x), y_(y) {}

    /// Adds the relative squared errors of every filter to its plane.
    void add_errors(const std::vector<DenoiseFilter>& filters, std::vector<Plane>& errors) {
        const size_t references = guides_.references.size();
        std::vector<std::vector<float>> padded(6 * references);
        for (size_t m = 0; m < references; ++m) {
            for (size_t k = 0; k < 6; ++k) {
                auto& plane = padded[6 * m + k];
                plane.resize(size_t(DenoiseKernel::padded) * DenoiseKernel::padded);
                const ReferenceMix& mix = guides_.references[m];
                kernel_.copy_padded([&](size_t i) { return mix.value(k / 3, k % 3, i); },
                                    plane.data());
            }
        }
        norms_.assign(3 * references, {});
        for (size_t f = 0; f <= filters.size(); ++f) {
            for (size_t half = 0; half < 2; ++half) {
                if (f < filters.size())
                    kernel_.find_weights(int(1 - half), filters[f], weights_);
                else
                    set_identity();
                for (size_t m = 0; m < references; ++m) {
                    for (size_t c = 0; c < 3; ++c)
                        compare(3 * m + c, padded[6 * m + 3 * half + c],
                                padded[6 * m + 3 * (1 - half) + c], errors[f]);
                }
            }
        }
    }

  private:
    void set_identity() {
        std::fill(weights_.begin(), weights_.end(), 0.0f);
        std::fill_n(weights_.begin() + std::ptrdiff_t(center * DenoiseKernel::tile_pixels),
                    DenoiseKernel::tile_pixels, 1.0f);
    }

    void compare(size_t channel,
                 const std::vector<float>& own,
                 const std::vector<float>& other,
                 Plane& errors) {
        float filtered[DenoiseKernel::tile_pixels];
        DenoiseKernel::apply(weights_, own.data(), filtered);
        // What errors are relative to is the same for all filters: the first one's result
        std::vector<float>& norm = norms_[channel];
        if (norm.empty()) norm.assign(filtered, filtered + DenoiseKernel::tile_pixels);
        for_each_pixel(guides_.window, x_, y_, [&](size_t i, size_t pixel) {
            const size_t v = i / T + DenoiseKernel::halo, u = i % T + DenoiseKernel::halo;
            const float d = filtered[i] - other[v * DenoiseKernel::padded + u];
            errors[pixel] += d * d / (norm[i] * norm[i] + 0.01f);
        });
    }

    const DenoiseGuides& guides_;
    DenoiseKernel& kernel_;
    int x_, y_;
    DenoiseKernel::Weights weights_;
    std::vector<std::vector<float>> norms_;  ///< [mix and channel][tile]
};

/// Shares from errors: the least of the smoothed ones takes the pixel, then shares are smoothed.
void choose_by_errors(const image::Window& window,
                      std::vector<Plane>& errors,
                      FilterChoice& choice) {
    constexpr int error_radius = 5, share_radius = 2;
    const auto smooth = [&](Plane& plane, int radius) {
        const auto mean =
            image::box_mean({plane.begin(), plane.end()}, window.width(), window.height(), radius);
        plane.assign(mean.begin(), mean.end());
    };
    for (Plane& plane : errors) smooth(plane, error_radius);
    for (size_t i = 0; i < window.pixel_count(); ++i) {
        size_t best = 0;
        for (size_t f = 1; f < errors.size(); ++f) {
            if (errors[f][i] < errors[best][i]) best = f;
        }
        for (size_t f = 0; f < errors.size(); ++f) choice.shares[f][i] = f == best ? 1.0f : 0.0f;
    }
    for (Plane& plane : choice.shares) smooth(plane, share_radius);
}

}  // namespace

void for_each_tile(const DenoiseGuides& guides,
                   const std::function<void(DenoiseKernel&, int, int)>& body) {
    const int columns = (guides.window.width() + T - 1) / T;
    const int rows = (guides.window.height() + T - 1) / T;
    parallel_for(size_t(columns * rows), [&](size_t tile) {
        DenoiseKernel kernel(guides);
        const int x = int(tile) % columns * T, y = int(tile) / columns * T;
        kernel.move_to(x, y);
        body(kernel, x, y);
    });
}

FilterChoice choose_filters(const DenoiseGuides& guides) {
    FilterChoice choice;
    choice.filters = filters();
    const size_t count = choice.filters.size() + 1;
    const size_t pixels = guides.window.pixel_count();
    choice.shares.assign(count, Plane(pixels, 0.0f));
    if (!guides.has_halves) {
        choice.shares[1].assign(pixels, 1.0f);
        return choice;
    }
    std::vector<Plane> errors(count, Plane(pixels, 0.0f));
    for_each_tile(guides, [&](DenoiseKernel& kernel, int x, int y) {
        TileJudge(guides, kernel, x, y).add_errors(choice.filters, errors);
    });
    choose_by_errors(guides.window, errors, choice);
    return choice;
}

void chosen_weights(DenoiseKernel& kernel,
                    const FilterChoice& choice,
                    const image::Window& window,
                    int x,
                    int y,
                    int half,
                    DenoiseKernel::Weights& weights,
                    DenoiseKernel::Weights& scratch) {
    constexpr size_t pixels = DenoiseKernel::tile_pixels;
    weights.assign(size_t(DenoiseKernel::neighbors) * pixels, 0.0f);
    for (size_t f = 0; f < choice.shares.size(); ++f) {
        float share[pixels] = {};
        bool is_used = false;
        for_each_pixel(window, x, y, [&](size_t i, size_t pixel) {
            share[i] = choice.shares[f][pixel];
            is_used = is_used || share[i] > 0.0f;
        });
        if (!is_used) continue;
        if (f == choice.filters.size()) {
            for (size_t i = 0; i < pixels; ++i) weights[center * pixels + i] += share[i];
            continue;
        }
        kernel.find_weights(half, choice.filters[f], scratch);
        for (size_t n = 0; n < size_t(DenoiseKernel::neighbors); ++n) {
            for (size_t i = 0; i < pixels; ++i)
                weights[n * pixels + i] += share[i] * scratch[n * pixels + i];
        }
    }
}

}  // namespace velatura::compositor::denoise
