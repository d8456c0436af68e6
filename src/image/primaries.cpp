// SPDX-License-Identifier: Apache-2.0
#include "image/primaries.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace velatura::image {

namespace {

constexpr auto rec709_names = std::to_array<std::string_view>(
    {"lin_rec709_scene", "lin_rec709", "lin_rec709_srgb", "lin_srgb", "Linear Rec.709 (sRGB)",
     "Linear Rec.709", "Linear BT.709", "Linear sRGB", "Linear - sRGB", "Linear - Rec.709",
     "Utility - Linear - Rec.709", "Utility - Linear - sRGB", "scene-linear Rec.709-sRGB",
     "scene-linear Rec 709/sRGB", "linear_srgb", "linear_rec709", "rec709_linear", "srgb_linear"});
constexpr auto ap1_names = std::to_array<std::string_view>(
    {"lin_ap1_scene", "ACEScg", "ACES - ACEScg", "scene-linear AP1", "Linear ACEScg", "lin_ap1"});
constexpr auto ap0_names =
    std::to_array<std::string_view>({"lin_ap0_scene", "ACES2065-1", "ACES - ACES2065-1",
                                     "aces2065_1", "Linear ACES2065-1", "Linear ACES", "lin_ap0"});
constexpr auto p3_names = std::to_array<std::string_view>(
    {"lin_p3d65_scene", "lin_p3d65", "Linear P3-D65", "Utility - Linear - P3-D65",
     "Linear DCI-P3 D65", "scene-linear DCI-P3 D65", "lin_displayp3", "linear_p3d65"});
constexpr auto rec2020_names = std::to_array<std::string_view>(
    {"lin_rec2020_scene", "lin_rec2020", "Linear Rec.2020", "Utility - Linear - Rec.2020",
     "Linear BT.2020", "scene-linear Rec.2020", "linear_rec2020"});
constexpr auto adobe_names =
    std::to_array<std::string_view>({"lin_adobergb_scene", "lin_adobergb", "Linear AdobeRGB",
                                     "Linear Adobe RGB", "Utility - Linear - Adobe RGB"});
constexpr auto xyz_names = std::to_array<std::string_view>(
    {"lin_ciexyzd65_scene", "lin_ciexyzd65", "Linear CIE-XYZ D65", "cie_xyz_d65_scene"});

const std::array<StandardSpace, 7> spaces = {{
    {"linear Rec.709", {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}, rec709_names},
    {"ACEScg", {0.713f, 0.293f, 0.165f, 0.830f, 0.128f, 0.044f, 0.32168f, 0.33767f}, ap1_names},
    {"ACES2065-1",
     {0.7347f, 0.2653f, 0.0f, 1.0f, 0.0001f, -0.0770f, 0.32168f, 0.33767f},
     ap0_names},
    {"linear P3-D65", {0.680f, 0.320f, 0.265f, 0.690f, 0.150f, 0.060f, 0.3127f, 0.3290f}, p3_names},
    {"linear Rec.2020",
     {0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f},
     rec2020_names},
    {"linear Adobe RGB", {0.64f, 0.33f, 0.21f, 0.71f, 0.15f, 0.06f, 0.3127f, 0.3290f}, adobe_names},
    {"CIE XYZ (D65)", {1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.3127f, 0.3290f}, xyz_names},
}};

constexpr std::array<double, 2> aces_white = {0.32168, 0.33767};

using Column = std::array<double, 3>;

Column times(const ColorMatrix& m, const Column& v) {
    Column r{};
    for (size_t i = 0; i < 3; ++i)
        r[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
    return r;
}

/// XYZ of luminance 1.
Column white_of(double x, double y) {
    return {x / y, 1.0, (1.0 - x - y) / y};
}

ColorMatrix scaled_columns(ColorMatrix m, const Column& s) {
    for (size_t i = 0; i < 9; ++i) m[i] *= s[i % 3];
    return m;
}

std::optional<ColorMatrix> xyz_from_rgb(const std::array<double, 8>& p) {
    ColorMatrix m{};
    for (size_t c = 0; c < 3; ++c) {
        m[c] = p[2 * c];
        m[3 + c] = p[2 * c + 1];
        m[6 + c] = 1.0 - p[2 * c] - p[2 * c + 1];
    }
    const auto back = inverse(m);
    if (!back || !(p[7] > 1e-3)) return std::nullopt;
    const Column scale = times(*back, white_of(p[6], p[7]));
    if (!(std::min({scale[0], scale[1], scale[2]}) > 1e-6)) return std::nullopt;
    return scaled_columns(m, scale);
}

/// XYZ seen under one white → the same look under another.
ColorMatrix bradford(const Column& from, const Column& to) {
    constexpr ColorMatrix cones = {0.8951, 0.2664, -0.1614, -0.7502, 1.7135,
                                   0.0367, 0.0389, -0.0685, 1.0296};
    const Column a = times(cones, from), b = times(cones, to);
    ColorMatrix scaled = cones;
    for (size_t i = 0; i < 9; ++i) scaled[i] *= b[i / 3] / a[i / 3];
    return product(*inverse(cones), scaled);
}

bool is_same_name(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

ColorMatrix product(const ColorMatrix& a, const ColorMatrix& b) {
    ColorMatrix m{};
    for (size_t i = 0; i < 9; ++i) {
        for (size_t k = 0; k < 3; ++k) m[i] += a[i / 3 * 3 + k] * b[3 * k + i % 3];
    }
    return m;
}

std::optional<ColorMatrix> inverse(const ColorMatrix& m) {
    const auto minor = [&m](size_t a, size_t b, size_t c, size_t d) {
        return m[a] * m[d] - m[b] * m[c];
    };
    const double det =
        m[0] * minor(4, 5, 7, 8) - m[1] * minor(3, 5, 6, 8) + m[2] * minor(3, 4, 6, 7);
    if (!(std::abs(det) > 1e-9) || !std::isfinite(det)) return std::nullopt;
    ColorMatrix r = {minor(4, 5, 7, 8), minor(2, 1, 8, 7), minor(1, 2, 4, 5),
                     minor(5, 3, 8, 6), minor(0, 2, 6, 8), minor(2, 0, 5, 3),
                     minor(3, 4, 6, 7), minor(1, 0, 7, 6), minor(0, 1, 3, 4)};
    for (double& v : r) v /= det;
    return r;
}

std::optional<ColorMatrix> aces_from_rgb(const Chromaticities& primaries) {
    // Decimal fractions, which floats are near
    std::array<double, 8> p{};
    for (size_t i = 0; i < 8; ++i) p[i] = std::round(double(primaries[i]) * 1e6) / 1e6;
    const auto to_xyz = xyz_from_rgb(p);
    if (!to_xyz) return std::nullopt;
    static const ColorMatrix aces_from_xyz = *inverse(
        *xyz_from_rgb({0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, aces_white[0], aces_white[1]}));
    const ColorMatrix adapted =
        product(bradford(white_of(p[6], p[7]), white_of(aces_white[0], aces_white[1])), *to_xyz);
    return product(aces_from_xyz, adapted);
}

std::span<const StandardSpace> standard_spaces() {
    return spaces;
}

const StandardSpace* standard_space(std::string_view name) {
    for (const StandardSpace& space : spaces) {
        if (std::any_of(space.names.begin(), space.names.end(),
                        [&](std::string_view n) { return is_same_name(n, name); }))
            return &space;
    }
    return nullptr;
}

const StandardSpace* standard_space(const Chromaticities& primaries) {
    constexpr float near = 0.002f;
    for (const StandardSpace& space : spaces) {
        if (std::equal(primaries.begin(), primaries.end(), space.primaries.begin(),
                       [](float a, float b) { return std::abs(a - b) < near; }))
            return &space;
    }
    return nullptr;
}

const StandardSpace& linear_rec709() {
    return spaces[0];
}

}  // namespace velatura::image
