// SPDX-License-Identifier: Apache-2.0
#include "shading/albedo.h"

#include "shading/bsdf.h"
#include "shading/fresnel.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

struct Node {
    size_t index;
    float t;
};

/// Position on an axis of count nodes over [0, 1].
Node node_at(float x, size_t count) {
    const float scaled = std::clamp(x, 0.0f, 1.0f) * float(count - 1);
    const size_t index = std::min(size_t(scaled), count - 2);
    return {index, scaled - float(index)};
}

float alpha_axis(float alpha) {
    using namespace albedo_tables;
    return (std::sqrt(alpha) - root_alpha_min) / (1.0f - root_alpha_min);
}

float mix(float a, float b, float t) {
    return a + (b - a) * t;
}

using Table = float[albedo_tables::alpha_count][albedo_tables::mu_count];

float table_at(const Table& table, const Node& a, const Node& m) {
    return mix(mix(table[a.index][m.index], table[a.index][m.index + 1], m.t),
               mix(table[a.index + 1][m.index], table[a.index + 1][m.index + 1], m.t), a.t);
}

}  // namespace

GgxAlbedoCurve::GgxAlbedoCurve(float alpha) : alpha_(alpha) {
    if (alpha < specular_switch_alpha) return;
    const Node a = node_at(alpha_axis(alpha), albedo_tables::alpha_count);
    row_ = uint32_t(a.index);
    row_t_ = a.t;
}

GgxAlbedo GgxAlbedoCurve::at(float mu) const {
    using namespace albedo_tables;
    if (alpha_ < specular_switch_alpha) return {0.0f, schlick_weight(mu)};
    const Node a = {row_, row_t_};
    // 1 − t = α·(1 − μ) / (μ + α)
    const float w = safe_sqrt(1.0f - safe_sqrt(alpha_ * (1.0f - mu) / (mu + alpha_)));
    const Node m = node_at(w, mu_count);
    const float lost = table_at(loss, a, m);
    return {lost, (1.0f - lost) * schlick_weight(table_at(cosine, a, m) * (mu + alpha_))};
}

GgxAlbedo GgxAlbedoCurve::average() const {
    using namespace albedo_tables;
    if (alpha_ < specular_switch_alpha) return {0.0f, 1.0f / 21.0f};
    const Node a = node_at(alpha_axis(alpha_), average_count);
    return {mix(average_loss[a.index], average_loss[a.index + 1], a.t) * alpha_ * alpha_,
            mix(average_schlick[a.index], average_schlick[a.index + 1], a.t)};
}

Rgb multiple_scattering_fresnel(const Rgb& f_average, float average_loss) {
    const auto channel = [average_loss](float f) {
        return f * f * (1.0f - average_loss) / (1.0f - f * average_loss);
    };
    return {channel(f_average.x), channel(f_average.y), channel(f_average.z)};
}

}  // namespace velatura::shading
