// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_display.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace velatura::compositor::exports {

namespace {

float srgb_from_linear(float v) {
    return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
}

double linear_from_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

/// Colors of 14 stops, from gray to saturated.
std::vector<float> probes() {
    std::vector<float> rgb;
    // Halton's numbers: as good as random ones, and always the same
    const auto halton = [](int i, int base) {
        double f = 1, r = 0;
        for (; i > 0; i /= base) {
            f /= base;
            r += f * (i % base);
        }
        return r;
    };
    for (int i = 1; i <= 4096; ++i) {
        const double level = std::exp2(14 * halton(i, 2) - 10), spread = 6 * halton(i, 3);
        for (const int base : {5, 7, 11})
            rgb.push_back(float(level * std::exp2(-spread * halton(i, base))));
    }
    return rgb;
}

/// Within a 40th of a step of 8 bits, where a display shows it.
bool are_same(const std::vector<float>& a, const std::vector<float>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), [](float x, float y) {
        return std::abs(std::clamp(x, 0.0f, 1.0f) - std::clamp(y, 0.0f, 1.0f)) < 1e-4f;
    });
}

/// The matrix before the curve of sRGB, if the transform is these two: from a gray and what each
/// channel adds to it.
image::ColorMatrix matrix_before_srgb(const image::DisplayTransform& transform) {
    constexpr float gray = 0.2f, more = 0.1f;
    std::vector<float> rgb(12, gray);
    for (size_t c = 0; c < 3; ++c) rgb[3 + 4 * c] += more;
    transform.apply(rgb);
    image::ColorMatrix matrix{};
    for (size_t row = 0; row < 3; ++row) {
        const double base = linear_from_srgb(double(rgb[row]));
        for (size_t c = 0; c < 3; ++c) {
            const double change = linear_from_srgb(double(rgb[3 + 3 * c + row])) - base;
            const double entry = change / double((gray + more) - gray);
            // Floats hold no more than this of it
            matrix[3 * row + c] = std::round(entry * 1e5) / 1e5;
        }
    }
    return matrix;
}

std::vector<uint16_t> baked(const image::DisplayTransform& transform) {
    const double range = std::log2(1.0 + double(lut_scale) * double(lut_max));
    std::array<float, lut_size> at{};
    for (size_t i = 0; i < at.size(); ++i)
        at[i] = float((std::exp2(range * double(i) / (lut_size - 1)) - 1) / double(lut_scale));
    std::vector<float> rgb;
    rgb.reserve(3 * at.size() * at.size() * at.size());
    for (const float blue : at)
        for (const float green : at)
            for (const float red : at) rgb.insert(rgb.end(), {red, green, blue});
    transform.apply(rgb);
    std::vector<uint16_t> codes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), codes.begin(), [](float v) {
        const double clamped = v > -0.5f ? std::min(double(v), 1.5) : -0.5;
        return uint16_t(std::lround((clamped + 0.5) / 2 * lut_codes));
    });
    return codes;
}

/// One color by four entries of the table: the corners of the tetrahedron that it is in.
void look_up(const std::vector<uint16_t>& lut, float* rgb) {
    static const float range = std::log2(1.0f + lut_scale * lut_max);
    constexpr std::array<size_t, 3> step = {3, 3 * lut_size, 3 * lut_size * lut_size};
    std::array<float, 3> rest{};
    size_t corner = 0;
    for (size_t c = 0; c < 3; ++c) {
        const float x = rgb[c] > 0.0f ? std::min(rgb[c], lut_max) : 0.0f;
        const float place = std::log2(1.0f + lut_scale * x) / range * (lut_size - 1);
        const float cell = std::min(std::floor(place), float(lut_size - 2));
        rest[c] = place - cell;
        corner += size_t(cell) * step[c];
    }
    std::array<size_t, 3> order = {0, 1, 2};
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return rest[a] > rest[b]; });
    const std::array<float, 4> weight = {1 - rest[order[0]], rest[order[0]] - rest[order[1]],
                                         rest[order[1]] - rest[order[2]], rest[order[2]]};
    std::array<float, 3> sum{};
    for (size_t k = 0; k < 4; ++k) {
        for (size_t c = 0; c < 3; ++c) sum[c] += weight[k] * float(lut[corner + c]);
        if (k < 3) corner += step[order[k]];
    }
    for (size_t c = 0; c < 3; ++c) rgb[c] = sum[c] * (2.0f / float(lut_codes)) - 0.5f;
}

}  // namespace

void WebDisplay::apply(std::vector<float>& rgb) const {
    for (size_t i = 0; i + 2 < rgb.size(); i += 3) {
        if (kind == Kind::Lut) look_up(lut, &rgb[i]);
        if (kind != Kind::Srgb) continue;
        const std::array<float, 3> in = {rgb[i], rgb[i + 1], rgb[i + 2]};
        for (size_t c = 0; c < 3; ++c)
            rgb[i + c] =
                srgb_from_linear(float(matrix[3 * c]) * in[0] + float(matrix[3 * c + 1]) * in[1] +
                                 float(matrix[3 * c + 2]) * in[2]);
    }
}

std::string WebDisplay::text() const {
    if (kind == Kind::Raw) return "the numbers as they are";
    if (kind == Kind::Srgb) return "the curve of sRGB";
    return fmt::format("a LUT of {0}x{0}x{0}", lut_size);
}

WebDisplay web_display(const image::DisplayTransform& transform) {
    const std::vector<float> colors = probes();
    std::vector<float> shown = colors;
    transform.apply(shown);
    WebDisplay display;
    if (are_same(shown, colors)) return display;
    display.kind = WebDisplay::Kind::Srgb;
    display.matrix = matrix_before_srgb(transform);
    std::vector<float> tried = colors;
    display.apply(tried);
    if (are_same(shown, tried)) return display;
    display.kind = WebDisplay::Kind::Lut;
    display.lut = baked(transform);
    return display;
}

}  // namespace velatura::compositor::exports
