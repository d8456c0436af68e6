// SPDX-License-Identifier: Apache-2.0
#include "compositor/denoise/denoise_kernel.h"

#include <algorithm>
#include <cmath>

namespace velatura::compositor::denoise {

namespace {

using K = DenoiseKernel;
constexpr int T = K::tile_size;
constexpr int P = K::padded;
constexpr int patch_area = T + 2 * K::patch_radius;
constexpr size_t max_features = 8;

/// e^-x for x >= 0 within 0.03, 0 from x = 8 on.
inline float falloff(float x) {
    const float t = std::max(0.0f, 1.0f - x * 0.125f);
    const float t2 = t * t, t4 = t2 * t2;
    return t4 * t4;
}

/// Calls f(neighbor, dx, dy) for the whole window.
template <class F>
void for_each_neighbor(F f) {
    size_t n = 0;
    for (int dy = -K::radius; dy <= K::radius; ++dy) {
        for (int dx = -K::radius; dx <= K::radius; ++dx) f(n++, dx, dy);
    }
}

/// Position in a padded tile of the tile's pixel (0, y), moved.
constexpr size_t padded_index(int y, int dx, int dy) {
    return size_t((y + K::halo + dy) * P + K::halo + dx);
}

/// Means of a patch of that radius around every pixel of the tile: in [patch_area]², out [T]².
template <int radius>
void patch_means(const float* in, float* out) {
    constexpr int side = 2 * radius + 1, offset = K::patch_radius - radius;
    float rows[patch_area * T];
    for (int y = 0; y < patch_area; ++y) {
        const float* from = in + y * patch_area + offset;
        float* to = rows + y * T;
        std::fill(to, to + T, 0.0f);
        for (int k = 0; k < side; ++k) {
            for (int x = 0; x < T; ++x) to[x] += from[x + k];
        }
    }
    constexpr float scale = 1.0f / float(side * side);
    for (int y = 0; y < T; ++y) {
        float* to = out + y * T;
        std::fill(to, to + T, 0.0f);
        for (int k = 0; k < side; ++k) {
            const float* from = rows + (y + k + offset) * T;
            for (int x = 0; x < T; ++x) to[x] += from[x];
        }
        for (int x = 0; x < T; ++x) to[x] *= scale;
    }
}

/// Solves S x = b for a symmetric positive definite S of n rows by Cholesky; S is overwritten.
void solve(double (&S)[max_features][max_features], double (&b)[max_features], size_t n) {
    for (size_t j = 0; j < n; ++j) {
        for (size_t k = 0; k < j; ++k) S[j][j] -= S[j][k] * S[j][k];
        S[j][j] = std::sqrt(S[j][j]);
        for (size_t i = j + 1; i < n; ++i) {
            for (size_t k = 0; k < j; ++k) S[i][j] -= S[i][k] * S[j][k];
            S[i][j] /= S[j][j];
        }
    }
    for (size_t i = 0; i < n; ++i) {
        for (size_t k = 0; k < i; ++k) b[i] -= S[i][k] * b[k];
        b[i] /= S[i][i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; ++k) b[i] -= S[k][i] * b[k];
        b[i] /= S[i][i];
    }
}

}  // namespace

DenoiseKernel::DenoiseKernel(const DenoiseGuides& guides)
    : guides_(guides),
      source_(size_t(P) * P),
      is_inside_(size_t(P) * P),
      features_(guides.features.size(), std::vector<float>(size_t(P) * P)),
      feature_distances_(neighbors * tile_pixels) {
    for (auto& d : color_distances_) d.resize(neighbors * tile_pixels);
}

void DenoiseKernel::move_to(int x, int y) {
    const int width = guides_.window.width(), height = guides_.window.height();
    for (int i = 0; i < P; ++i) {
        for (int j = 0; j < P; ++j) {
            const int u = x + j - halo, v = y + i - halo;
            const int cu = std::clamp(u, 0, width - 1), cv = std::clamp(v, 0, height - 1);
            source_[size_t(i * P + j)] = size_t(cv) * size_t(width) + size_t(cu);
            is_inside_[size_t(i * P + j)] = u == cu && v == cv ? 1.0f : 0.0f;
        }
    }
    for (size_t f = 0; f < features_.size(); ++f) {
        const Plane& plane = guides_.features[f];
        copy_padded([&](size_t i) { return plane[i]; }, features_[f].data());
    }
    find_feature_distances();
    for (int half = 0; half < (guides_.has_halves ? 2 : 1); ++half) find_color_distances(half);
}

void DenoiseKernel::find_color_distances(int half) {
    std::array<std::vector<float>, 3> value, variance;
    for (size_t c = 0; c < 3; ++c) {
        value[c].resize(size_t(P) * P);
        variance[c].resize(size_t(P) * P);
        const Plane& v = guides_.color.half[size_t(half)][c];
        const Plane& s = guides_.color.variance[c];
        copy_padded([&](size_t i) { return v[i]; }, value[c].data());
        copy_padded([&](size_t i) { return s[i]; }, variance[c].data());
    }
    std::vector<float> distance(size_t(patch_area) * patch_area);
    float near[tile_pixels];
    for_each_neighbor([&](size_t n, int dx, int dy) {
        std::fill(distance.begin(), distance.end(), 0.0f);
        for (size_t c = 0; c < 3; ++c) {
            for (int y = 0; y < patch_area; ++y) {
                const size_t at = size_t((y + radius) * P + radius);
                const size_t moved = size_t((y + radius + dy) * P + radius + dx);
                const float* p = &value[c][at];
                const float* q = &value[c][moved];
                const float* vp = &variance[c][at];
                const float* vq = &variance[c][moved];
                float* d = &distance[size_t(y * patch_area)];
                for (int x = 0; x < patch_area; ++x) {
                    const float difference = p[x] - q[x];
                    const float noise = vp[x] + std::min(vp[x], vq[x]);
                    d[x] += (difference * difference - noise) / (vp[x] + vq[x] + 1e-20f);
                }
            }
        }
        float* out = &color_distances_[size_t(half)][n * tile_pixels];
        patch_means<patch_radius>(distance.data(), out);
        patch_means<1>(distance.data(), near);
        // A large patch dilutes what is small and very bright: its own surroundings have a say,
        // with some allowance for their noise
        for (size_t i = 0; i < tile_pixels; ++i)
            out[i] = std::max({0.0f, out[i] * (1.0f / 3.0f), near[i] * (1.0f / 3.0f) - 1.0f});
    });
}

void DenoiseKernel::find_feature_distances() {
    for_each_neighbor([&](size_t n, int dx, int dy) {
        float* out = &feature_distances_[n * tile_pixels];
        std::fill(out, out + tile_pixels, 0.0f);
        for (const auto& feature : features_) {
            for (int y = 0; y < T; ++y) {
                const float* p = &feature[padded_index(y, 0, 0)];
                const float* q = &feature[padded_index(y, dx, dy)];
                for (int x = 0; x < T; ++x) {
                    const float difference = p[x] - q[x];
                    out[y * T + x] += difference * difference;
                }
            }
        }
    });
}

void DenoiseKernel::weigh_by_distances(int half,
                                       const DenoiseFilter& filter,
                                       Weights& weights) const {
    const float by_color = 1.0f / (filter.color_width * filter.color_width);
    const float by_feature = 1.0f / (filter.feature_width * filter.feature_width);
    const auto& distances = color_distances_[guides_.has_halves ? size_t(half) : 0];
    weights.resize(neighbors * tile_pixels);
    for_each_neighbor([&](size_t n, int dx, int dy) {
        const float* color = &distances[n * tile_pixels];
        const float* feature = &feature_distances_[n * tile_pixels];
        float* w = &weights[n * tile_pixels];
        for (int y = 0; y < T; ++y) {
            const float* inside = &is_inside_[padded_index(y, dx, dy)];
            for (int x = 0; x < T; ++x) {
                const int i = y * T + x;
                w[i] = inside[x] * falloff(color[i] * by_color + feature[i] * by_feature);
            }
        }
    });
}

void DenoiseKernel::normalize(Weights& weights) const {
    float sum[tile_pixels] = {};
    for (size_t n = 0; n < neighbors; ++n) {
        const float* w = &weights[n * tile_pixels];
        for (size_t i = 0; i < tile_pixels; ++i) sum[i] += w[i];
    }
    // Beyond the image's edge a tile has pixels without neighbors
    for (float& s : sum) s = s > 0.0f ? 1.0f / s : 0.0f;
    for (size_t n = 0; n < neighbors; ++n) {
        float* w = &weights[n * tile_pixels];
        for (size_t i = 0; i < tile_pixels; ++i) w[i] *= sum[i];
    }
}

void DenoiseKernel::regress(Weights& weights) const {
    const size_t count = features_.size();
    if (count == 0) return;
    constexpr float ridge = 1e-3f;
    // Weighted first and second moments of the features' differences to the pixel
    std::vector<float> first(count * tile_pixels, 0.0f);
    std::vector<float> second(count * count * tile_pixels, 0.0f);
    float x_of[max_features][T];
    for_each_neighbor([&](size_t n, int dx, int dy) {
        for (int y = 0; y < T; ++y) {
            const float* w = &weights[n * tile_pixels + size_t(y * T)];
            for (size_t j = 0; j < count; ++j) {
                const float* p = &features_[j][padded_index(y, 0, 0)];
                const float* q = &features_[j][padded_index(y, dx, dy)];
                float* m = &first[j * tile_pixels + size_t(y * T)];
                float wx[T];
                for (int x = 0; x < T; ++x) {
                    x_of[j][x] = q[x] - p[x];
                    wx[x] = w[x] * x_of[j][x];
                    m[x] += wx[x];
                }
                for (size_t k = 0; k <= j; ++k) {
                    float* s = &second[(j * count + k) * tile_pixels + size_t(y * T)];
                    for (int x = 0; x < T; ++x) s[x] += wx[x] * x_of[k][x];
                }
            }
        }
    });
    // Slope of the weights over the features that brings the features' weighted mean to the pixel
    std::vector<float> slope(count * tile_pixels);
    for (size_t i = 0; i < tile_pixels; ++i) {
        double S[max_features][max_features], b[max_features];
        for (size_t j = 0; j < count; ++j) {
            const auto mj = double(first[j * tile_pixels + i]);
            for (size_t k = 0; k <= j; ++k)
                S[j][k] = double(second[(j * count + k) * tile_pixels + i]) -
                          mj * double(first[k * tile_pixels + i]);
            S[j][j] = std::max(S[j][j], 0.0) + double(ridge);
            b[j] = -mj;
        }
        solve(S, b, count);
        for (size_t j = 0; j < count; ++j) slope[j * tile_pixels + i] = float(b[j]);
    }
    for_each_neighbor([&](size_t n, int dx, int dy) {
        for (int y = 0; y < T; ++y) {
            float factor[T];
            std::fill(factor, factor + T, 1.0f);
            for (size_t j = 0; j < count; ++j) {
                const float* p = &features_[j][padded_index(y, 0, 0)];
                const float* q = &features_[j][padded_index(y, dx, dy)];
                const float* m = &first[j * tile_pixels + size_t(y * T)];
                const float* b = &slope[j * tile_pixels + size_t(y * T)];
                for (int x = 0; x < T; ++x) factor[x] += b[x] * (q[x] - p[x] - m[x]);
            }
            float* w = &weights[n * tile_pixels + size_t(y * T)];
            for (int x = 0; x < T; ++x) w[x] *= factor[x];
        }
    });
}

void DenoiseKernel::find_weights(int half, const DenoiseFilter& filter, Weights& weights) {
    weigh_by_distances(half, filter, weights);
    normalize(weights);
    if (filter.is_first_order) regress(weights);
}

void DenoiseKernel::apply(const Weights& weights, const float* padded_plane, float* out) {
    std::fill(out, out + tile_pixels, 0.0f);
    for_each_neighbor([&](size_t n, int dx, int dy) {
        for (int y = 0; y < T; ++y) {
            const float* w = &weights[n * tile_pixels + size_t(y * T)];
            const float* q = padded_plane + padded_index(y, dx, dy);
            float* to = out + y * T;
            for (int x = 0; x < T; ++x) to[x] += w[x] * q[x];
        }
    });
}

}  // namespace velatura::compositor::denoise
