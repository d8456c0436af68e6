// SPDX-License-Identifier: Apache-2.0
#include "translate/color/named_color_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>

namespace velatura::translate::color {

namespace {

constexpr std::array<double, 2> d65 = {0.3127, 0.3290};
constexpr std::array<double, 2> aces_white = {0.32168, 0.33767};
constexpr Primaries rec709 = {{0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, d65};
/// SMPTE ST 2065-1 and S-2014-004.
constexpr Primaries ap0 = {{0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, aces_white};
constexpr Primaries ap1 = {{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, aces_white};
/// SMPTE EG 432-1, ITU-R BT.2020 and Adobe RGB (1998).
constexpr Primaries p3 = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65};
constexpr Primaries rec2020 = {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65};
constexpr Primaries adobe_rgb = {{0.640, 0.330}, {0.210, 0.710}, {0.150, 0.060}, d65};

/// Column vectors: result = m · v, as books write it.
Mat3d product(const Mat3d& a, const Mat3d& b) {
    return b * a;  // of row vectors
}

Mat3d rows(const std::array<std::array<double, 3>, 3>& m) {
    Mat3d out;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out[j][i] = m[size_t(i)][size_t(j)];
    return out;
}

Vec3d xyz_of(const std::array<double, 2>& xy) {
    return {xy[0] / xy[1], 1.0, (1.0 - xy[0] - xy[1]) / xy[1]};
}

/// XYZ of what stands white under `white` as it looks under D65. Ref: Bradford's cone responses, as
/// in ICC.1:2022, annex E.
Mat3d to_d65(const std::array<double, 2>& white) {
    if (white == d65) return Mat3d();
    const Mat3d cones =
        rows({{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}});
    const Vec3d from = xyz_of(white) * cones, to = xyz_of(d65) * cones;
    Mat3d scale;
    for (int i = 0; i < 3; ++i) scale[i][i] = to[i] / from[i];
    return product(cones.inverse(), product(scale, cones));
}

Mat3d xyz_from_rgb(const Primaries& p) {
    // Chromaticities that are given as (x, y) alone, also where y is 0
    const auto column = [](const std::array<double, 2>& c) {
        return Vec3d(c[0], c[1], 1.0 - c[0] - c[1]);
    };
    Mat3d m;
    const Vec3d columns[3] = {column(p.red), column(p.green), column(p.blue)};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) m[i][k] = columns[i][k];
    const Vec3d amounts = xyz_of(p.white) * m.inverse();
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) m[i][k] *= amounts[i];
    return m;
}

ColorMatrix rows_of(const Mat3d& m) {
    ColorMatrix out;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out[size_t(3 * i + j)] = m[j][i];
    return out;
}

Mat3d matrix_of(const ColorMatrix& m) {
    return rows({{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}});
}

ColorMatrix to_rec709(const Mat3d& d65_from_rgb) {
    return rows_of(product(xyz_from_rgb(rec709).inverse(), d65_from_rgb));
}

enum class Curve : uint8_t { None, Srgb, G18, G22, G24, AdobeRgb };
enum class Gamut : uint8_t { Data, Rec709, Ap0, Ap1, P3, Rec2020, AdobeRgb, Xyz };

constexpr size_t gamut_count = 8;

struct SpaceNames {
    Curve curve;
    Gamut gamut;
    /// Small letters and digits alone, a blank between two names.
    std::string_view names;
};

/// Ref: Color Interop Forum, "Color Space Encodings for Texture Assets and CG Rendering";
/// MaterialX Specification 1.38 and 1.39, "Color Spaces and Color Management Systems"; the ACES
/// configurations of OpenColorIO 1 and 2 and the one of Maya.
constexpr SpaceNames space_names[] = {
    {Curve::None, Gamut::Data, "none raw data identity unknown noncolor utilityraw"},
    {Curve::None, Gamut::Rec709,
     "linrec709 linrec709scene linrec709display linsrgb linear scenelinear linearrec709 linearsrgb "
     "linearrec709srgb srgblinear utilitylinearrec709 utilitylinearsrgb scenelinearrec709srgb"},
    {Curve::Srgb, Gamut::Rec709,
     "srgb srgbtexture srgbtx srgbrec709scene srgbrec709display texturesrgb inputtexturesrgb "
     "utilitysrgbtexture inputgenericsrgbtexture srgbencodedrec709 srgbencodedrec709srgb "
     "srgbscenereferred"},
    {Curve::G18, Gamut::Rec709,
     "gamma18 g18rec709 g18rec709scene gamma18rec709 gamma18encodedrec709 gammaencoded18rec709"},
    {Curve::G22, Gamut::Rec709,
     "gamma22 g22rec709 g22rec709scene g22rec709display gamma22rec709 gamma22encodedrec709"},
    {Curve::G24, Gamut::Rec709,
     "gamma24 rec709display g24rec709 g24rec709scene g24rec709display gamma24rec709"},
    {Curve::None, Gamut::Ap0,
     "aces aces20651 acesaces20651 linap0 linap0scene linearaces linearap0"},
    {Curve::None, Gamut::Ap1, "acescg acesacescg linap1 linap1scene linearacescg linearap1"},
    {Curve::Srgb, Gamut::Ap1, "srgbap1 srgbap1scene srgbencodedap1"},
    {Curve::G22, Gamut::Ap1, "g22ap1 g22ap1scene gamma22ap1 gamma22encodedap1"},
    {Curve::None, Gamut::P3,
     "lindisplayp3 linp3d65 linp3d65scene linp3d65display linearp3d65 lineardcip3d65 "
     "lineardisplayp3 scenelinearp3d65"},
    {Curve::Srgb, Gamut::P3,
     "displayp3 srgbdisplayp3 srgbp3d65 srgbp3d65scene srgbp3d65display srgbencodedp3d65"},
    {Curve::None, Gamut::Rec2020,
     "linrec2020 linrec2020scene linrec2020display linearrec2020 utilitylinearrec2020"},
    {Curve::None, Gamut::AdobeRgb, "linadobergb linadobergbscene linearadobergb"},
    {Curve::AdobeRgb, Gamut::AdobeRgb,
     "adobergb g22adobergb g22adobergbscene g22adobergbdisplay gamma22encodedadobergb"},
    {Curve::None, Gamut::Xyz,
     "linciexyzd65 linciexyzd65scene linearciexyzd65 ciexyzd65 ciexyzd65scenereferred "
     "ciexyzd65scene"},
};

scene::ColorDecoding curve_alone(Curve curve) {
    scene::ColorDecoding out;
    switch (curve) {
        case Curve::None:
            break;
        case Curve::Srgb:  // IEC 61966-2-1
            out.exponent = 2.4;
            out.offset = 0.055;
            out.cut = 0.04045;
            out.slope = 12.92;
            break;
        case Curve::G18:
            out.exponent = 1.8;
            break;
        case Curve::G22:
            out.exponent = 2.2;
            break;
        case Curve::G24:
            out.exponent = 2.4;
            break;
        case Curve::AdobeRgb:
            out.exponent = 563.0 / 256.0;
            break;
    }
    return out;
}

Mat3d d65_from(const Primaries& p) {
    return product(to_d65(p.white), xyz_from_rgb(p));
}

Mat3d d65_from(Gamut gamut) {
    switch (gamut) {
        case Gamut::Data:
        case Gamut::Rec709:
            break;
        case Gamut::Ap0:
            return d65_from(ap0);
        case Gamut::Ap1:
            return d65_from(ap1);
        case Gamut::P3:
            return d65_from(p3);
        case Gamut::Rec2020:
            return d65_from(rec2020);
        case Gamut::AdobeRgb:
            return d65_from(adobe_rgb);
        case Gamut::Xyz:
            return Mat3d();
    }
    return xyz_from_rgb(rec709);
}

/// A space that a scene can be rendered in.
struct WorkingChoice {
    std::string_view id, label;
    Gamut gamut;
};

/// CIE XYZ is none: its white is not of three equal numbers.
constexpr WorkingChoice working_choices[] = {
    {"lin_rec709_scene", "linear Rec.709", Gamut::Rec709},
    {"lin_ap1_scene", "ACEScg", Gamut::Ap1},
    {"lin_ap0_scene", "ACES2065-1", Gamut::Ap0},
    {"lin_rec2020_scene", "linear Rec.2020", Gamut::Rec2020},
    {"lin_p3d65_scene", "linear P3-D65", Gamut::P3},
    {"lin_adobergb_scene", "linear Adobe RGB", Gamut::AdobeRgb}};

std::map<std::string, ColorSpace, std::less<>> make_spaces() {
    std::array<Mat3d, gamut_count> matrices;
    for (size_t i = 0; i < gamut_count; ++i) matrices[i] = d65_from(Gamut(i));
    std::map<std::string, ColorSpace, std::less<>> spaces;
    for (const SpaceNames& row : space_names) {
        ColorSpace space{curve_alone(row.curve), row.curve == Curve::Srgb,
                         row.gamut == Gamut::Data};
        const Mat3d& matrix = matrices[size_t(row.gamut)];
        space.d65_from_rgb = rows_of(matrix);
        if (row.gamut > Gamut::Rec709) space.decoding.to_working = to_rec709(matrix);
        for (std::string_view rest = row.names; !rest.empty();) {
            const size_t end = std::min(rest.find(' '), rest.size());
            spaces.emplace(rest.substr(0, end), space);
            rest.remove_prefix(std::min(end + 1, rest.size()));
        }
    }
    return spaces;
}

/// Without the words that the ACES configurations add to the names of texture spaces: "Utility -
/// Gamma 2.4 - Rec.709 - Texture", "g24_rec709_tx".
std::string_view core_name(std::string_view bare) {
    for (const std::string_view before : {"utility", "input"})
        if (bare.starts_with(before)) bare.remove_prefix(before.size());
    for (const std::string_view after : {"texture", "tx"})
        if (bare.ends_with(after)) bare.remove_suffix(after.size());
    return bare;
}

}  // namespace

const ColorMatrix& d65_from_rec709() {
    static const ColorMatrix matrix = rows_of(xyz_from_rgb(rec709));
    return matrix;
}

const ColorSpace* named_color_space(std::string_view name) {
    static const auto spaces = make_spaces();
    static const ColorSpace linear;
    if (name.empty()) return &linear;
    const std::string bare = bare_color_space_name(name);
    const std::string_view core = core_name(bare);
    for (const std::string_view spelling : {std::string_view(bare), core})
        if (const auto at = spaces.find(spelling); at != spaces.end()) return &at->second;
    return nullptr;
}

std::string bare_color_space_name(std::string_view name) {
    std::string out;
    for (const char c : name) {
        const auto byte = static_cast<unsigned char>(c);
        if (std::isalnum(byte)) out.push_back(char(std::tolower(byte)));
    }
    return out;
}

std::optional<ColorSpace> linear_space_of(const Primaries& p) {
    constexpr double min_area = 1e-6;
    const auto side = [&](const std::array<double, 2>& c, int i) {
        return c[size_t(i)] - p.red[size_t(i)];
    };
    const double area = side(p.green, 0) * side(p.blue, 1) - side(p.green, 1) * side(p.blue, 0);
    if (!(std::abs(area) > min_area)) return std::nullopt;
    const Mat3d matrix = d65_from(p);
    ColorSpace space;
    space.d65_from_rgb = rows_of(matrix);
    const ColorMatrix& out = space.decoding.to_working = to_rec709(matrix);
    const bool is_good =
        std::all_of(out.begin(), out.end(), [](double v) { return std::isfinite(v); });
    return is_good ? std::optional(space) : std::nullopt;
}

std::optional<WorkingSpace> WorkingSpace::named(std::string_view name) {
    const ColorSpace* space = named_color_space(name);
    if (space == nullptr || space->is_data || space->decoding.has_curve()) return std::nullopt;
    for (const WorkingChoice& choice : working_choices) {
        const ColorSpace& of_choice = *named_color_space(choice.id);
        if (of_choice.d65_from_rgb != space->d65_from_rgb) continue;
        WorkingSpace working;
        working.id_ = choice.id;
        working.label_ = choice.label;
        working.d65_from_rgb_ = space->d65_from_rgb;
        return working;
    }
    return std::nullopt;
}

std::string WorkingSpace::choices() {
    std::string text;
    for (const WorkingChoice& choice : working_choices)
        text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", choice.id, choice.label);
    return text;
}

scene::ColorDecoding WorkingSpace::from(const ColorSpace& space) const {
    scene::ColorDecoding decoding = space.decoding;
    if (is_rec709() || space.is_data) return decoding;
    decoding.to_working = scene::ColorDecoding().to_working;
    if (space.d65_from_rgb == d65_from_rgb_) return decoding;
    decoding.to_working =
        rows_of(product(matrix_of(d65_from_rgb_).inverse(), matrix_of(space.d65_from_rgb)));
    // A channel that a color has no part in stays without it
    constexpr double rounding = 1e-12;
    for (double& v : decoding.to_working)
        if (std::abs(v) < rounding) v = 0.0;
    return decoding;
}

}  // namespace velatura::translate::color
