// SPDX-License-Identifier: Apache-2.0
#include "shading/sheen.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

float lerp(float a, float b, float t) {
    return a + (b - a) * t;
}

/// ∫ f·μi dω over the hemisphere, by the midpoint rule in √μi and φ.
float albedo_of(float mu_o, float roughness) {
    constexpr int rows = 96, columns = 64;
    const float sin_o = std::sqrt(std::max(1.0f - mu_o * mu_o, 0.0f));
    double sum = 0;
    for (int i = 0; i < rows; ++i) {
        const float x = (float(i) + 0.5f) / float(rows), mu_i = x * x;
        const float sin_i = std::sqrt(std::max(1.0f - mu_i * mu_i, 0.0f));
        double row = 0;
        for (int k = 0; k < columns; ++k) {
            const float phi = pi * (float(k) + 0.5f) / float(columns);
            const float cos_oi = mu_o * mu_i + sin_o * sin_i * std::cos(phi);
            const float length = std::sqrt(std::max(2.0f + 2.0f * cos_oi, 1e-12f));
            row += double(sheen_f(mu_o, mu_i, std::min((mu_o + mu_i) / length, 1.0f), roughness));
        }
        // μ dμ = 2x³ dx
        sum += row * double(2.0f * mu_i * x);
    }
    // φ goes half way round twice
    return float(sum * 2 * pi_d / double(rows * columns));
}

/// Cosine of a column: many at grazing angles.
float cosine_of(int column, int count) {
    const float x = float(column) / float(count - 1);
    return std::max(x * x, 1e-4f);
}

}  // namespace

float sheen_f(float mu_o, float mu_i, float cos_m, float roughness) {
    const float power = 1.0f / roughness;
    const float sine2 = std::max(1.0f - cos_m * cos_m, 0.0f);
    const float d = (2.0f + power) * std::pow(sine2, 0.5f * power) * (0.5f * inv_pi);
    return d / (4.0f * (mu_o + mu_i - mu_o * mu_i));
}

const SheenAlbedo& SheenAlbedo::of_process() {
    static const SheenAlbedo table;
    return table;
}

SheenAlbedo::SheenAlbedo() {
    for (int w = 0; w < widths; ++w) {
        // Smooth fibers differ most: many of them
        const float x = float(w) / float(widths - 1);
        const float roughness = lerp(min_roughness, 1.0f, x * x);
        float max = 1.0f;
        for (int c = 0; c < cosines; ++c) {
            raw_[size_t(w)][size_t(c)] = albedo_of(cosine_of(c, cosines), roughness);
            max = std::max(max, raw_[size_t(w)][size_t(c)]);
        }
        scale_[size_t(w)] = 1.0f / max;
    }
}

SheenAlbedo::Place SheenAlbedo::width_place(float roughness) {
    const float share = (roughness - min_roughness) / (1.0f - min_roughness);
    const float x = std::sqrt(std::clamp(share, 0.0f, 1.0f)) * float(widths - 1);
    const int index = std::clamp(int(x), 0, widths - 2);
    return {index, std::clamp(x - float(index), 0.0f, 1.0f)};
}

float SheenAlbedo::scale(float roughness) const {
    const Place w = width_place(roughness);
    return lerp(scale_[size_t(w.index)], scale_[size_t(w.index) + 1], w.t);
}

float SheenAlbedo::at(float mu, float roughness) const {
    const Place w = width_place(roughness);
    const float x = std::sqrt(std::clamp(mu, 0.0f, 1.0f)) * float(cosines - 1);
    const int c = std::clamp(int(x), 0, cosines - 2);
    const float t = std::clamp(x - float(c), 0.0f, 1.0f);
    const auto row = [&](int i) {
        return lerp(raw_[size_t(i)][size_t(c)], raw_[size_t(i)][size_t(c) + 1], t);
    };
    return std::min(scale(roughness) * lerp(row(w.index), row(w.index + 1), w.t), 1.0f);
}

}  // namespace velatura::shading
