// SPDX-License-Identifier: Apache-2.0
#include "shading/thin_film.h"

#include "image/primaries.h"
#include "shading/bsdf_value.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/lattice.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <mutex>

namespace velatura::shading {

namespace film_observer {

namespace {

/// CIE 1931 2° color matching functions x̄ ȳ z̄ (CIE 018:2019, table 6) and the relative power of
/// illuminant D65 (CIE 15:2018, table 5), every 10 nm.
constexpr double table[][4] = {
    {0.001368, 0.000039, 0.006450, 49.9755}, {0.004243, 0.000120, 0.020050, 54.6482},
    {0.014310, 0.000396, 0.067850, 82.7549}, {0.043510, 0.001210, 0.207400, 91.4860},
    {0.134380, 0.004000, 0.645600, 93.4318}, {0.283900, 0.011600, 1.385600, 86.6823},
    {0.348280, 0.023000, 1.747060, 104.865}, {0.336200, 0.038000, 1.772110, 117.008},
    {0.290800, 0.060000, 1.669200, 117.812}, {0.195360, 0.090980, 1.287640, 114.861},
    {0.095640, 0.139020, 0.812950, 115.923}, {0.032010, 0.208020, 0.465180, 108.811},
    {0.004900, 0.323000, 0.272000, 109.354}, {0.009300, 0.503000, 0.158200, 107.802},
    {0.063270, 0.710000, 0.078250, 104.790}, {0.165500, 0.862000, 0.042160, 107.689},
    {0.290400, 0.954000, 0.020300, 104.405}, {0.433450, 0.994950, 0.008750, 104.046},
    {0.594500, 0.995000, 0.003900, 100.000}, {0.762100, 0.952000, 0.002100, 96.3342},
    {0.916300, 0.870000, 0.001650, 95.7880}, {1.026300, 0.757000, 0.001100, 88.6856},
    {1.062200, 0.631000, 0.000800, 90.0062}, {1.002600, 0.503000, 0.000340, 89.5991},
    {0.854450, 0.381000, 0.000190, 87.6987}, {0.642400, 0.265000, 0.000050, 83.2886},
    {0.447900, 0.175000, 0.000020, 83.6992}, {0.283500, 0.107000, 0.000000, 80.0268},
    {0.164900, 0.061000, 0.000000, 80.2146}, {0.087400, 0.032000, 0.000000, 82.2778},
    {0.046770, 0.017000, 0.000000, 78.2842}, {0.022700, 0.008210, 0.000000, 69.7213},
    {0.011359, 0.004102, 0.000000, 71.6091}, {0.005790, 0.002091, 0.000000, 74.3490},
    {0.002899, 0.001047, 0.000000, 61.6040}, {0.001440, 0.000520, 0.000000, 69.8856},
    {0.000690, 0.000249, 0.000000, 75.0870}, {0.000332, 0.000120, 0.000000, 63.5927},
    {0.000166, 0.000060, 0.000000, 46.4182}, {0.000083, 0.000030, 0.000000, 66.8054},
    {0.000042, 0.000015, 0.000000, 63.3828}};
constexpr int table_step = 10;

}  // namespace

std::vector<Vec3d> shares(std::string_view working_space) {
    std::vector<Vec3d> out;
    Vec3d sum(0.0);
    for (int nm = first_nm; nm <= last_nm; ++nm) {
        const int i = std::min((nm - first_nm) / table_step, int(std::size(table)) - 2);
        const double t = double(nm - first_nm - i * table_step) / table_step;
        const auto at = [&](int k) { return table[i][k] + (table[i + 1][k] - table[i][k]) * t; };
        const double power = at(3), x = at(0) * power, y = at(1) * power, z = at(2) * power;
        // IEC 61966-2-1
        const Vec3d rgb(3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
                        -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
                        0.0556434 * x - 0.2040259 * y + 1.0572252 * z);
        out.push_back(rgb);
        sum += rgb;
    }
    for (Vec3d& share : out) share /= sum;
    const image::StandardSpace* space = image::standard_space(working_space);
    if (!space || space == &image::linear_rec709()) return out;
    // White stays white, so that the sums stay 1
    const image::ColorMatrix to_aces = *image::aces_from_rgb(image::linear_rec709().primaries);
    const image::ColorMatrix m =
        image::product(*image::inverse(*image::aces_from_rgb(space->primaries)), to_aces);
    for (Vec3d& share : out) {
        const Vec3d s = share;
        for (int c = 0; c < 3; ++c) {
            const size_t row = 3 * size_t(c);
            share[c] = m[row] * s.x + m[row + 1] * s.y + m[row + 2] * s.z;
        }
    }
    return out;
}

}  // namespace film_observer

FilmSpectrum::FilmSpectrum(std::string_view working_space) {
    const std::vector<Vec3d> shares = film_observer::shares(working_space);
    const int count = int(reach) * steps_per_unit + 1;
    std::vector<std::array<Vec3d, 2>> sums(size_t(count), {Vec3d(0.0), Vec3d(0.0)});
    for (size_t i = 0; i < shares.size(); ++i) {
        const double wavelength = 1e-3 * double(film_observer::first_nm + int(i));
        const std::complex<double> turn =
            std::polar(1.0, 2.0 * pi_d / (wavelength * steps_per_unit));
        std::complex<double> phase = 1.0;
        for (auto& sum : sums) {
            sum[0] += shares[i] * phase.real();
            sum[1] += shares[i] * phase.imag();
            phase *= turn;
        }
    }
    table_.reserve(size_t(count));
    for (int k = 0; k < count; ++k) {
        // The last fringes fade out where the table ends
        const double x = double(k) / (count - 1), fade = std::min(1.0, 8.0 * (1.0 - x));
        table_.push_back(
            {to_float(sums[size_t(k)][0] * fade), to_float(sums[size_t(k)][1] * fade)});
    }
}

FilmSpectrum::Means FilmSpectrum::at(float difference) const {
    const float scaled = difference * float(steps_per_unit);
    if (!(scaled < float(table_.size() - 1))) return {};
    const size_t i = size_t(scaled);
    const float t = scaled - float(i);
    const Means &a = table_[i], &b = table_[i + 1];
    return {a.cosine + (b.cosine - a.cosine) * t, a.sine + (b.sine - a.sine) * t};
}

namespace {

constexpr float root_alpha_min = 0.0316227766f;  // specular_switch_alpha

/// Place between two of `count` nodes over [0, 1].
struct NodePlace {
    size_t index;
    float t;
};

NodePlace node_place(float x, int count) {
    const float scaled = std::clamp(x, 0.0f, 1.0f) * float(count - 1);
    const size_t index = std::min(size_t(scaled), size_t(count - 2));
    return {index, scaled - float(index)};
}

NodePlace width_place(float alpha, int rows) {
    return node_place((std::sqrt(alpha) - root_alpha_min) / (1.0f - root_alpha_min), rows);
}

double width_of(int row, int rows) {
    const double low = double(root_alpha_min);
    const double root = low + (1.0 - low) * double(row) / (rows - 1);
    return root * root;
}

/// The axis of the albedo tables (albedo.h), and back.
float cosine_axis(float mu, float alpha) {
    return safe_sqrt(1.0f - safe_sqrt(alpha * (1.0f - mu) / (mu + alpha)));
}

double cosine_of(double axis, double alpha) {
    const double root = 1.0 - axis * axis, rest = root * root;
    return alpha * (1.0 - rest) / (rest + alpha);
}

struct FacetSample {
    double cosine, weight;
};

/// Facets that are visible from the cosine mu, by the light they reflect.
void add_facets(std::vector<FacetSample>& out,
                const std::vector<Vec2d>& turns,
                double mu,
                double alpha) {
    const Vec3d wo(std::sqrt(std::max(0.0, 1.0 - mu * mu)), 0.0, mu);
    const double g1 = ggx_g1(mu, alpha), count = double(turns.size());
    for (size_t i = 0; i < turns.size(); ++i) {
        const Vec3d wm = ggx_sample_normal(wo, alpha, turns[i], (double(i) + 0.5) / count);
        const double c = wo.dot(wm);
        const Vec3d wi = wm * (2.0 * c) - wo;
        if (!(c > 0.0 && wi.z > 0.0)) continue;
        out.push_back({c, 4.0 * mu * ggx_visibility(wo, wi, alpha) / g1 * wi.z / count});
    }
}

/// Mean cosines of equal shares of the weight.
template <size_t count>
std::array<float, count> shares_of(std::vector<FacetSample>& samples) {
    std::sort(samples.begin(), samples.end(),
              [](const FacetSample& a, const FacetSample& b) { return a.cosine < b.cosine; });
    double all = 0.0;
    for (const FacetSample& s : samples) all += s.weight;
    std::array<float, count> out = {};
    const double share = all / double(count);
    size_t k = 0;
    double filled = 0.0, sum = 0.0, last = 0.0;
    for (const FacetSample& s : samples) {
        double rest = s.weight;
        last = s.cosine;
        while (k < count - 1 && filled + rest > share) {
            const double part = share - filled;
            out[k++] = float((sum + part * s.cosine) / share);
            rest -= part;
            filled = sum = 0.0;
        }
        filled += rest;
        sum += rest * s.cosine;
    }
    for (; k < count; ++k, filled = 0.0) out[k] = filled > 0.0 ? float(sum / filled) : float(last);
    return out;
}

template <size_t count>
std::array<float, count> mix(const std::array<float, count>& a,
                             const std::array<float, count>& b,
                             float t) {
    std::array<float, count> out;
    for (size_t i = 0; i < count; ++i) out[i] = a[i] + (b[i] - a[i]) * t;
    return out;
}

}  // namespace

FacetCosines::FacetCosines() {
    constexpr int facet_count = 377, average_facets = 89, average_cosines = 32;
    const std::vector<Vec2d> turns = lattice_turns(facet_count, 0.5);
    const std::vector<Vec2d> few = lattice_turns(average_facets, 0.5);
    std::vector<FacetSample> samples;
    for (int row = 0; row < rows; ++row) {
        const double alpha = width_of(row, rows);
        for (int column = 0; column < columns; ++column) {
            samples.clear();
            const double mu = cosine_of(double(column) / (columns - 1), alpha);
            add_facets(samples, turns, std::max(mu, 1e-6), alpha);
            at_.push_back(shares_of<count>(samples));
        }
        samples.clear();
        for (int i = 0; i < average_cosines; ++i) {
            // Equal steps of μ² have equal weight
            const double mu = std::sqrt((i + 0.5) / average_cosines);
            add_facets(samples, few, mu, alpha);
        }
        average_.push_back(shares_of<average_count>(samples));
    }
}

std::array<float, FacetCosines::count> FacetCosines::at(float mu, float alpha) const {
    std::array<float, count> out;
    if (alpha < specular_switch_alpha) {
        out.fill(mu);
        return out;
    }
    const NodePlace w = width_place(alpha, rows);
    const auto row = [&](size_t r) {
        // Each row has an axis of its own
        const float width = float(width_of(int(r), rows));
        const NodePlace m = node_place(cosine_axis(mu, width), columns);
        const std::array<float, count>* nodes = &at_[r * columns];
        return mix(nodes[m.index], nodes[m.index + 1], m.t);
    };
    return mix(row(w.index), row(w.index + 1), w.t);
}

std::array<float, FacetCosines::average_count> FacetCosines::average(float alpha) const {
    if (alpha < specular_switch_alpha) {
        std::array<float, average_count> out;
        for (int i = 0; i < average_count; ++i)
            out[size_t(i)] = std::sqrt((float(i) + 0.5f) / float(average_count));
        return out;
    }
    const NodePlace w = width_place(alpha, rows);
    return mix(average_[w.index], average_[w.index + 1], w.t);
}

const FilmTables& FilmTables::of_process(std::string_view working_space) {
    static const FacetCosines cosines;
    static std::mutex mutex;
    static std::map<const image::StandardSpace*, FilmTables> tables;
    const image::StandardSpace* space = image::standard_space(working_space);
    const std::lock_guard lock(mutex);
    const auto made = tables.find(space);
    if (made != tables.end()) return made->second;
    return tables.emplace(space, FilmTables{FilmSpectrum(working_space), cosines}).first->second;
}

MetalIndex metal_index(float f0, float at_82) {
    constexpr double c = 1.0 / 7.0, c2 = c * c, rest = 1.0 - c2;
    const double r = std::clamp(double(f0), 1e-4, 0.9999), aside = double(at_82);
    const double root = std::sqrt(r), s = 2.0 * (1.0 + r) / (1.0 - r);
    // n² + k² of what reflects r is s·n − 1, so that a polarization reflects (A − 2cn) / (A + 2cn)
    // at the cosine c, with A linear in n: a quadratic, positive where too much is reflected
    const double q2 =
        (1.0 - aside) * c2 * s * s - 2.0 * aside * c * s * (1.0 + c2) - 4.0 * (1.0 + aside) * c2;
    const double q1 = (1.0 - aside) * rest * rest * s, q0 = -(1.0 - aside) * rest * rest;
    const auto excess = [&](double n) { return (q2 * n + q1) * n + q0; };
    // The less n, the more the metal reflects aside
    const double low = (1.0 - r) / (1.0 + r), high = (1.0 + root) / (1.0 - root);
    double n = low;
    if (excess(high) >= 0.0)
        n = high;
    else if (excess(low) > 0.0)
        n = std::clamp((q1 + std::sqrt(std::max(q1 * q1 - 4.0 * q2 * q0, 0.0))) / (-2.0 * q2), low,
                       high);
    return {float(n), float(std::sqrt(std::max(s * n - 1.0 - n * n, 0.0)))};
}

/// What light meets first.
struct FilmFresnel::Entry {
    float sine2;
    float film;      ///< cosine in the film
    float first[2];  ///< amplitude above the film, by the polarization: s, p
};

namespace {

/// (a − b) / (a + b).
float amplitude(float a, float b) {
    const float sum = a + b;
    return sum > 0.0f ? (a - b) / sum : -1.0f;
}

struct Complex {
    float re = 0, im = 0;
};

Complex operator*(float s, const Complex& a) {
    return {s * a.re, s * a.im};
}

Complex amplitude(const Complex& a, const Complex& b) {
    const Complex d{a.re - b.re, a.im - b.im}, sum{a.re + b.re, a.im + b.im};
    const float norm = sum.re * sum.re + sum.im * sum.im;
    if (!(norm > 0.0f)) return {-1.0f, 0.0f};
    return {(d.re * sum.re + d.im * sum.im) / norm, (d.im * sum.re - d.re * sum.im) / norm};
}

/// Of a number above the real axis or on it, the root there.
Complex root_of(const Complex& z) {
    const float length = std::sqrt(z.re * z.re + z.im * z.im);
    const float larger = std::sqrt(0.5f * (length + std::abs(z.re)));
    if (!(larger > 0.0f)) return {};
    const float smaller = 0.5f * z.im / larger;
    return z.re >= 0.0f ? Complex{larger, smaller} : Complex{smaller, larger};
}

constexpr int max_terms = 256;
constexpr float smallest_term_in_means = 1e-3f;

/// Half of 1 − R without interference, of a polarization whose amplitudes are real above the film,
/// with the square `second2` below it.
float mean_share(float first, float second2, float ratio2) {
    const float rest = (1.0f - first * first) * (1.0f - second2);
    return ratio2 < 1.0f ? std::max(0.5f * rest / (1.0f - ratio2), 0.0f) : 0.0f;
}

}  // namespace

FilmFresnel::FilmFresnel(const FilmParameters& film, const Rgb& bare_f0, const Rgb& bare_f90)
    : p_(film), bare_f0_(bare_f0), bare_f90_(bare_f90) {
    if (!(p_.metallic > 0.0f) || p_.curve) return;
    // Schlick's weight at a cosine of 1/7
    const Rgb at_82 = p_.metal_f0 + (p_.metal_f90 - p_.metal_f0) * 0.46266438f;
    for (int c = 0; c < 3; ++c) metal_index_[size_t(c)] = metal_index(p_.metal_f0[c], at_82[c]);
}

/// False: the film reflects all.
bool FilmFresnel::enter(float cosine, Entry& entry) const {
    entry.sine2 = (1.0f - cosine) * (1.0f + cosine);
    const auto inside = [&](float index) { return 1.0f - entry.sine2 / (index * index); };
    const float film2 = inside(p_.ior);
    if (!(film2 > 0.0f)) return false;
    const float above = p_.above == 1.0f ? cosine : std::sqrt(std::max(inside(p_.above), 0.0f));
    entry.film = std::sqrt(film2);
    entry.first[0] = amplitude(p_.above * above, p_.ior * entry.film);
    entry.first[1] = amplitude(p_.ior * above, p_.above * entry.film);
    return true;
}

// 1 − R is Airy's formula (1 − r1²)(1 − |r2|²) / |1 + r1·r2·e^{iφ}|², for real r1: the Poisson
// kernel of ρ = r1·r2, 1 + 2 Σ Re((−ρ)^m·e^{imφ}) over 1 − |ρ|², whose mean over the wavelengths is
// one of FilmSpectrum per term. Colors of a spectrum outside of the working space are clipped

/// All amplitudes are real, and those of one polarization are the same for all channels.
Rgb FilmFresnel::dielectric(float cosine, float smallest_term) const {
    Entry entry;
    if (!enter(cosine, entry)) return Rgb(1.0f);
    const float below2 = 1.0f - entry.sine2 / (p_.below * p_.below);
    if (!(below2 > 0.0f)) return Rgb(1.0f);
    const float below = std::sqrt(below2);
    const float second[2] = {amplitude(p_.ior * entry.film, p_.below * below),
                             amplitude(p_.below * entry.film, p_.ior * below)};
    float ratio[2], term[2], passed = 0.0f, largest = 0.0f;
    for (int p = 0; p < 2; ++p) {
        ratio[p] = -entry.first[p] * second[p];
        const float share = mean_share(entry.first[p], second[p] * second[p], ratio[p] * ratio[p]);
        passed += share;
        term[p] = 2.0f * share;
        largest = std::max(largest, std::abs(ratio[p]));
    }
    if (!(passed > 0.0f)) return Rgb(1.0f);
    const float difference = 2.0f * p_.ior * p_.thickness * entry.film;
    Rgb reflected(1.0f - passed);
    float size = 1.0f;
    for (int m = 1; m <= max_terms; ++m) {
        size *= largest;
        const float x = difference * float(m);
        if (!(size > smallest_term) || !(x < FilmSpectrum::reach)) break;
        for (int p = 0; p < 2; ++p) term[p] *= ratio[p];
        reflected -= p_.tables->spectrum.at(x).cosine * (term[0] + term[1]);
    }
    return clamp01(reflected);
}

Rgb FilmFresnel::metal(float cosine, float smallest_term) const {
    Entry entry;
    if (!enter(cosine, entry)) return Rgb(1.0f);
    // By the polarization, then by the channel
    float re[2][3], im[2][3], term_re[2][3], term_im[2][3], largest = 0.0f;
    Rgb reflected(1.0f);
    for (int c = 0; c < 3; ++c) {
        const MetalIndex& index = metal_index_[size_t(c)];
        const Complex square{index.n * index.n - index.k * index.k, 2.0f * index.n * index.k};
        // Index times cosine
        const Complex below = root_of({square.re - entry.sine2, square.im});
        const Complex second[2] = {amplitude(Complex{p_.ior * entry.film, 0.0f}, below),
                                   amplitude(entry.film * square, p_.ior * below)};
        for (int p = 0; p < 2; ++p) {
            re[p][c] = -entry.first[p] * second[p].re;
            im[p][c] = -entry.first[p] * second[p].im;
            const float second2 = second[p].re * second[p].re + second[p].im * second[p].im;
            const float ratio2 = entry.first[p] * entry.first[p] * second2;
            const float share = mean_share(entry.first[p], second2, ratio2);
            reflected[c] -= share;
            term_re[p][c] = 2.0f * share;
            term_im[p][c] = 0.0f;
            largest = std::max(largest, ratio2);
        }
    }
    largest = std::sqrt(largest);
    const float difference = 2.0f * p_.ior * p_.thickness * entry.film;
    float size = 1.0f;
    for (int m = 1; m <= max_terms; ++m) {
        size *= largest;
        const float x = difference * float(m);
        if (!(size > smallest_term) || !(x < FilmSpectrum::reach)) break;
        for (int p = 0; p < 2; ++p) {
            for (int c = 0; c < 3; ++c) {
                const float next_re = term_re[p][c] * re[p][c] - term_im[p][c] * im[p][c];
                term_im[p][c] = term_re[p][c] * im[p][c] + term_im[p][c] * re[p][c];
                term_re[p][c] = next_re;
            }
        }
        const FilmSpectrum::Means means = p_.tables->spectrum.at(x);
        for (int c = 0; c < 3; ++c)
            reflected[c] -= (term_re[0][c] + term_re[1][c]) * means.cosine[c] -
                            (term_im[0][c] + term_im[1][c]) * means.sine[c];
    }
    return clamp01(reflected);
}

Rgb FilmFresnel::covered(float cosine, float smallest_term) const {
    if (p_.curve) return p_.curve->at(cosine);
    Rgb out(0.0f);
    if (p_.metallic < 1.0f)
        out += dielectric(cosine, smallest_term) * p_.tint * (1.0f - p_.metallic);
    if (p_.metallic > 0.0f) out += metal(cosine, smallest_term) * p_.metal_tint * p_.metallic;
    return out;
}

Rgb FilmFresnel::with_bare(const Rgb& covered, float cosine) const {
    if (p_.weight >= 1.0f) return covered;
    const Rgb bare = fresnel_schlick(bare_f0_, bare_f90_, cosine);
    return bare + (covered - bare) * p_.weight;
}

Rgb FilmFresnel::at(float cosine) const {
    const float c = std::clamp(cosine, 0.0f, 1.0f);
    return with_bare(covered(c), c);
}

Rgb FilmFresnel::at_in_mean(float cosine) const {
    const float c = std::clamp(cosine, 0.0f, 1.0f);
    return with_bare(nodes_ ? nodes_->at(c) : covered(c), c);
}

void FilmFresnel::prepare_means() {
    if (!p_.curve)
        nodes_.emplace([this](float cosine) { return covered(cosine, smallest_term_in_means); });
}

}  // namespace velatura::shading
