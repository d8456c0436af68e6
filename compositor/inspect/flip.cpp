// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/flip.h"

#include "base/tasks.h"
#include "canvas/color_scale.h"
#include "canvas/false_color.h"
#include "image/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace velatura::compositor::inspect {

namespace {

using Plane = std::vector<float>;
using Color = std::array<float, 3>;
using Matrix3 = std::array<std::array<float, 3>, 3>;

// Linear Rec.709 with white D65 (ITU-R BT.709, x y of IEC 61966-2-1)
constexpr Matrix3 xyz_from_rgb = {{{0.41239080f, 0.35758434f, 0.18048079f},
                                   {0.21263901f, 0.71516868f, 0.07219232f},
                                   {0.01933082f, 0.11919478f, 0.95053215f}}};
constexpr Matrix3 rgb_from_xyz = {{{3.24096994f, -1.53738318f, -0.49861076f},
                                   {-0.96924364f, 1.87596750f, 0.04155506f},
                                   {0.05563008f, -0.20397696f, 1.05697151f}}};
constexpr Color white = {0.95045593f, 1.0f, 1.08905775f};

// Andersson et al. 2020, sections 4 and 5
constexpr float color_exponent = 0.7f;
constexpr float linear_part = 0.4f, linear_range = 0.95f;
constexpr double feature_degrees = 0.082;
constexpr float feature_exponent = 0.5f;

Color multiply(const Matrix3& m, const Color& c) {
    Color out{};
    for (size_t r = 0; r < 3; ++r) out[r] = m[r][0] * c[0] + m[r][1] * c[1] + m[r][2] * c[2];
    return out;
}

/// Over the white; the first half of CIELAB and of the opponent space YCxCz.
Color relative_xyz(const Color& rgb) {
    Color xyz = multiply(xyz_from_rgb, rgb);
    for (size_t c = 0; c < 3; ++c) xyz[c] /= white[c];
    return xyz;
}

Color opponents(const Color& rgb) {
    const Color xyz = relative_xyz(rgb);
    return {116.0f * xyz[1] - 16.0f, 500.0f * (xyz[0] - xyz[1]), 200.0f * (xyz[1] - xyz[2])};
}

Color rgb_from_opponents(const Color& o) {
    const float y = (o[0] + 16.0f) / 116.0f;
    const Color xyz = {(y + o[1] / 500.0f) * white[0], y * white[1],
                       (y - o[2] / 200.0f) * white[2]};
    return multiply(rgb_from_xyz, xyz);
}

/// CIELAB with the Hunt effect: what is dark looks less colored.
Color hunt_lab(const Color& rgb) {
    constexpr float delta = 6.0f / 29.0f;
    const auto curve = [](float t) {
        return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0f / 29.0f;
    };
    const Color xyz = relative_xyz(rgb);
    const float fx = curve(xyz[0]), fy = curve(xyz[1]), fz = curve(xyz[2]);
    const float lightness = 116.0f * fy - 16.0f;
    return {lightness, 0.01f * lightness * 500.0f * (fx - fy),
            0.01f * lightness * 200.0f * (fy - fz)};
}

/// Abasi et al. 2020: for colors far apart.
float hyab(const Color& a, const Color& b) {
    return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

/// [0, 1]: most of the range to differences that are not huge.
float color_error(const Color& reference, const Color& test) {
    static const float max =
        std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), color_exponent);
    const float error = std::pow(hyab(hunt_lab(reference), hunt_lab(test)), color_exponent);
    const float knee = linear_part * max;
    if (error < knee) return error * linear_range / knee;
    return linear_range + (error - knee) / (max - knee) * (1.0f - linear_range);
}

/// Taps −radius … radius.
using Kernel = std::vector<float>;

Kernel gaussian(double sigma, int radius) {
    Kernel taps;
    for (int i = -radius; i <= radius; ++i)
        taps.push_back(float(std::exp(-0.5 * i * i / (sigma * sigma))));
    return taps;
}

/// Positive taps add up to 1 and negative ones to −1.
void normalize(Kernel& taps) {
    float positive = 0, negative = 0;
    for (const float t : taps) (t > 0 ? positive : negative) += t;
    for (float& t : taps) t /= t > 0 ? positive : -negative;
}

/// Along x, then along y; the border's values go on outside.
Plane filtered(
    const Plane& in, int width, int height, const Kernel& along_x, const Kernel& along_y) {
    const auto w = size_t(width), h = size_t(height);
    Plane middle(in.size()), out(in.size());
    const int rx = int(along_x.size() / 2), ry = int(along_y.size() / 2);
    parallel_for(h, [&](size_t y) {
        std::vector<float> row(w + 2 * size_t(rx));
        for (int x = -rx; x < width + rx; ++x)
            row[size_t(x + rx)] = in[y * w + size_t(std::clamp(x, 0, width - 1))];
        float* const to = &middle[y * w];
        std::fill(to, to + w, 0.0f);
        for (size_t k = 0; k < along_x.size(); ++k) {
            for (size_t x = 0; x < w; ++x) to[x] += along_x[k] * row[x + k];
        }
    });
    parallel_for(h, [&](size_t y) {
        float* const to = &out[y * w];
        std::fill(to, to + w, 0.0f);
        for (size_t k = 0; k < along_y.size(); ++k) {
            const int from = std::clamp(int(y) + int(k) - ry, 0, height - 1);
            const float* const row = &middle[size_t(from) * w];
            for (size_t x = 0; x < w; ++x) to[x] += along_y[k] * row[x];
        }
    });
    return out;
}

/// One Gaussian of a contrast sensitivity: weight · √(π/b) · exp(−π² degrees² / b).
struct Sensitivity {
    double weight, b;
};

Plane blurred(const Plane& in,
              int width,
              int height,
              const std::vector<Sensitivity>& terms,
              double ppd,
              int radius) {
    Plane out(in.size(), 0.0f);
    double whole = 0;
    std::vector<double> shares;
    std::vector<Kernel> kernels;
    for (const Sensitivity& s : terms) {
        Kernel taps = gaussian(std::sqrt(s.b / 2) / std::numbers::pi * ppd, radius);
        double sum = 0;
        for (const float t : taps) sum += double(t);
        for (float& t : taps) t = float(double(t) / sum);
        shares.push_back(s.weight * std::sqrt(std::numbers::pi / s.b) * sum * sum);
        whole += shares.back();
        kernels.push_back(std::move(taps));
    }
    for (size_t i = 0; i < kernels.size(); ++i) {
        const Plane part = filtered(in, width, height, kernels[i], kernels[i]);
        const auto share = float(shares[i] / whole);
        for (size_t p = 0; p < out.size(); ++p) out[p] += share * part[p];
    }
    return out;
}

/// What is left of an image at the distance from which it is seen, in linear Rec.709 within [0,
/// 1].
Planes seen(const Planes& opponent, double ppd) {
    static const std::array<std::vector<Sensitivity>, 3> sensitivities = {
        {{{1.0, 0.0047}}, {{1.0, 0.0053}}, {{34.1, 0.04}, {13.5, 0.025}}}};
    const int radius = int(std::ceil(3 * std::sqrt(0.04 / 2) / std::numbers::pi * ppd));
    Planes out{opponent.width, opponent.height, {}};
    for (size_t c = 0; c < 3; ++c)
        out.values[c] =
            blurred(opponent.values[c], out.width, out.height, sensitivities[c], ppd, radius);
    for (size_t i = 0; i < out.values[0].size(); ++i) {
        const Color rgb =
            rgb_from_opponents({out.values[0][i], out.values[1][i], out.values[2][i]});
        for (size_t c = 0; c < 3; ++c) out.values[c][i] = std::clamp(rgb[c], 0.0f, 1.0f);
    }
    return out;
}

/// How strong edges and points are, as the eye's receptive fields tell them.
struct Features {
    Plane edges, points;
};

Features features_of(const Planes& opponent, double ppd) {
    const double sigma = 0.5 * feature_degrees * ppd;
    const int radius = int(std::ceil(3 * sigma));
    Kernel smooth = gaussian(sigma, radius), first = smooth, second = smooth;
    for (int i = -radius; i <= radius; ++i) {
        first[size_t(i + radius)] *= float(-i);
        second[size_t(i + radius)] *= float(i * i / (sigma * sigma) - 1);
    }
    normalize(smooth);
    normalize(first);
    normalize(second);
    const int w = opponent.width, h = opponent.height;
    Plane light = opponent.values[0];
    for (float& v : light) v = (v + 16.0f) / 116.0f;
    const auto strength = [&](const Kernel& derivative) {
        const Plane x = filtered(light, w, h, derivative, smooth);
        Plane y = filtered(light, w, h, smooth, derivative);
        for (size_t i = 0; i < y.size(); ++i) y[i] = std::hypot(x[i], y[i]);
        return y;
    };
    return {strength(first), strength(second)};
}

Planes to_opponents(const Planes& rgb) {
    Planes out{rgb.width, rgb.height, rgb.values};
    for (size_t i = 0; i < out.values[0].size(); ++i) {
        Color c{};
        for (size_t k = 0; k < 3; ++k) c[k] = std::clamp(rgb.values[k][i], 0.0f, 1.0f);
        c = opponents(c);
        for (size_t k = 0; k < 3; ++k) out.values[k][i] = c[k];
    }
    return out;
}

/// (x (a x + b)) / (x (c x + d) + e): fitted to ACES by Narkowicz 2016, with his exposure of 0.6.
struct ToneCurve {
    float a = 0.36f * 2.51f, b = 0.6f * 0.03f, c = 0.36f * 2.43f, d = 0.6f * 0.59f, e = 0.14f;

    float operator()(float value) const {
        // Where the curve is flat; beyond, its squares are not finite
        const float x = std::min(value, 1e6f);
        return std::clamp(x * (a * x + b) / (x * (c * x + d) + e), 0.0f, 1.0f);
    }

    /// Where it reaches y.
    double inverse(double y) const {
        const double p = double(a) - y * double(c), q = double(b) - y * double(d),
                     r = -y * double(e);
        return (-q + std::sqrt(q * q - 4 * p * r)) / (2 * p);
    }
};

/// The exposures between which HDR-ꟻLIP looks, in stops: the brightest pixel comes to 0.85, then
/// the median.
std::pair<float, float> exposure_range(const Planes& reference) {
    constexpr double bright = 0.85;
    std::vector<float> luminances(reference.values[0].size(), 0.0f);
    for (size_t i = 0; i < luminances.size(); ++i) {
        for (size_t c = 0; c < 3; ++c) luminances[i] += xyz_from_rgb[1][c] * reference.values[c][i];
    }
    const auto median = [](std::vector<float>& values) {
        const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        return *middle;
    };
    float middle = median(luminances);
    if (!(middle > 0)) {
        // Of what is lit, where most of the image is black
        std::erase_if(luminances, [](float y) { return !(y > 0); });
        if (luminances.empty()) return {0.0f, 0.0f};
        middle = median(luminances);
    }
    const float largest = *std::max_element(luminances.begin(), luminances.end());
    const double x = ToneCurve().inverse(bright);
    return {float(std::log2(x / double(largest))), float(std::log2(x / double(middle)))};
}

Planes exposed(const Planes& in, float stops) {
    const ToneCurve curve;
    const float gain = std::exp2(stops);
    Planes out = in;
    for (Plane& plane : out.values) {
        for (float& v : plane) v = curve(std::max(0.0f, gain * v));
    }
    return out;
}

Planes finite(Planes planes) {
    for (Plane& plane : planes.values) {
        for (float& v : plane) v = std::isfinite(v) ? v : 0.0f;
    }
    return planes;
}

}  // namespace

std::vector<float> ldr_flip(const Planes& reference, const Planes& test, double pixels_per_degree) {
    const Planes a = to_opponents(reference), b = to_opponents(test);
    const Planes seen_a = seen(a, pixels_per_degree), seen_b = seen(b, pixels_per_degree);
    const Features features_a = features_of(a, pixels_per_degree),
                   features_b = features_of(b, pixels_per_degree);
    std::vector<float> map(a.values[0].size());
    for (size_t i = 0; i < map.size(); ++i) {
        const auto at = [i](const Planes& p) {
            return Color{p.values[0][i], p.values[1][i], p.values[2][i]};
        };
        const float color = color_error(at(seen_a), at(seen_b));
        const float difference = std::max(std::abs(features_a.edges[i] - features_b.edges[i]),
                                          std::abs(features_a.points[i] - features_b.points[i]));
        const float feature =
            std::pow(difference * std::numbers::sqrt2_v<float> / 2, feature_exponent);
        map[i] = std::pow(color, 1.0f - feature);
    }
    return map;
}

Flip hdr_flip(const Planes& reference, const Planes& test, double pixels_per_degree) {
    const Planes a = finite(reference), b = finite(test);
    Flip result;
    std::tie(result.first_stop, result.last_stop) = exposure_range(a);
    result.exposures = std::max(2, int(std::ceil(result.last_stop - result.first_stop)));
    result.map.assign(a.values[0].size(), 0.0f);
    for (int i = 0; i < result.exposures; ++i) {
        const float step = (result.last_stop - result.first_stop) / float(result.exposures - 1);
        const float stops = result.first_stop + float(i) * step;
        const std::vector<float> map =
            ldr_flip(exposed(a, stops), exposed(b, stops), pixels_per_degree);
        for (size_t p = 0; p < map.size(); ++p) result.map[p] = std::max(result.map[p], map[p]);
    }
    for (const float v : result.map) {
        result.mean += double(v) / double(result.map.size());
        result.largest = std::max(result.largest, double(v));
    }
    return result;
}

Result<Planes> planes_of(const image::Image& image, const std::string& layer) {
    Planes planes{image.data.width(), image.data.height(), {}};
    constexpr const char* names[] = {"R", "G", "B"};
    for (size_t c = 0; c < 3; ++c) {
        const std::string name = layer == "rgba" ? names[c] : fmt::format("{}.{}", layer, names[c]);
        const image::Channel* channel = image.find(name);
        if (!channel) return Error{"unknown-name", fmt::format("the file has no channel {}", name)};
        planes.values[c].resize(channel->size());
        image::for_each_value(*channel, [&](size_t i, float v) { planes.values[c][i] = v; });
    }
    return planes;
}

Result<void> write_flip_image(const std::string& path,
                              const image::Window& window,
                              const std::vector<float>& map) {
    std::vector<float> rgb(3 * map.size());
    for (size_t i = 0; i < map.size(); ++i) {
        const auto color = canvas::heat(map[i]);
        std::copy(color.begin(), color.end(), &rgb[3 * i]);
    }
    const canvas::Canvas scaled = canvas::with_heat_scale(
        window.width(), window.height(), rgb, {{0, "0"}, {0.25f, "0.25"}, {0.5f, "0.5"}, {1, "1"}});
    return image::write_display_image(path, scaled.width(), scaled.height(), scaled.rgb());
}

}  // namespace velatura::compositor::inspect
