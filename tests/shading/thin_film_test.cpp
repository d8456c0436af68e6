// SPDX-License-Identifier: Apache-2.0
// Thin films: against the characteristic matrix of the film, wavelength by wavelength; energy,
// reciprocity, samples.
#include "shading/thin_film.h"

#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "shading/fresnel.h"
#include "shading/material_evaluator.h"
#include "shading/rough_interface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <string>
#include <vector>

namespace velatura::shading {
namespace {

using Complex = std::complex<double>;
using testing::direction;

/// Row by row, of columns.
using Mat3 = std::array<std::array<double, 3>, 3>;
/// x and y of red, green, blue and white.
using Chart = std::array<double, 8>;

constexpr Chart rec709 = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};

Vec3d times(const Mat3& m, const Vec3d& v) {
    Vec3d out(0.0);
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) out[int(i)] += m[i][k] * v[int(k)];
    return out;
}

Mat3 times(const Mat3& a, const Mat3& b) {
    Mat3 out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            for (size_t k = 0; k < 3; ++k) out[i][j] += a[i][k] * b[k][j];
    return out;
}

/// Cramer's rule.
Mat3 inverse(const Mat3& m) {
    const auto cofactor = [&m](size_t r, size_t c) {
        const size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    double det = 0;
    for (size_t c = 0; c < 3; ++c) det += m[0][c] * cofactor(0, c);
    Mat3 out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) out[j][i] = cofactor(i, j) / det;
    return out;
}

const Vec3 up(0, 0, 1);

/// Reflectance of film and base at one wavelength, averaged over both polarizations, by the
/// characteristic matrix of the film. Ref: Macleod, "Thin-Film Optical Filters", section 2.6; time
/// dependence e^(−iωt).
double reflectance(
    double cosine, double above, double film, Complex below, double thickness, double wavelength) {
    const double sine = std::sqrt(1 - cosine * cosine);
    const auto cosine_in = [sine](Complex index) {
        return std::sqrt(Complex(1) - sine * sine / (index * index));
    };
    const Complex delta = 2 * pi_d * film * thickness * cosine_in(film) / wavelength;
    double sum = 0;
    for (const bool is_p : {false, true}) {
        const auto admittance = [&](Complex index) {
            return is_p ? index / cosine_in(index) : index * cosine_in(index);
        };
        const Complex y0 = admittance(above), y1 = admittance(film), y2 = admittance(below);
        const Complex i(0, 1);
        const Complex b = std::cos(delta) - i * std::sin(delta) / y1 * y2;
        const Complex c = -i * y1 * std::sin(delta) + std::cos(delta) * y2;
        sum += 0.5 * std::norm((y0 * b - c) / (y0 * b + c));
    }
    return sum;
}

/// The color of that in daylight.
Vec3d spectral_sum(
    double cosine, double above, double film, const std::vector<Complex>& below, double um) {
    static const std::vector<Vec3d> shares = film_observer::shares();
    Vec3d sum(0.0);
    int nm = film_observer::first_nm;
    for (const Vec3d& share : shares) {
        for (int c = 0; c < 3; ++c)
            sum[c] += share[c] * reflectance(cosine, above, film, below[size_t(c) % below.size()],
                                             um, 1e-3 * nm);
        ++nm;
    }
    return sum;
}

/// The same, clipped.
Rgb color(double cosine, double above, double film, const std::vector<Complex>& below, double um) {
    const Vec3d sum = spectral_sum(cosine, above, film, below, um);
    Rgb out;
    for (int c = 0; c < 3; ++c) out[c] = float(std::clamp(sum[c], 0.0, 1.0));
    return out;
}

FilmParameters film_on(float below, float thickness, float ior = 1.4f) {
    FilmParameters p;
    p.tables = &FilmTables::of_process("lin_rec709_scene");
    p.weight = 1;
    p.thickness = thickness;
    p.ior = ior;
    p.below = below;
    return p;
}

constexpr double cosines[] = {1.0, 0.8, 0.5, 0.25, 0.1, 0.03};
constexpr float thicknesses[] = {0.02f, 0.1f, 0.25f, 0.5f, 1.0f, 2.5f};

// Wyman, Sloan & Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching
// Functions", multi-lobe fit
TEST(ThinFilm, ColorsAreThoseOfTheStandardObserver) {
    const auto lobe = [](double nm, double mean, double below, double above) {
        const double t = (nm - mean) / (nm < mean ? below : above);
        return std::exp(-0.5 * t * t);
    };
    const std::vector<Vec3d> shares = film_observer::shares();
    Vec3d sum(0.0);
    for (const Vec3d& s : shares) sum += s;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], 1.0, 1e-12);
    for (int nm = 440; nm <= 630; nm += 10) {
        const double x = 1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
                         0.065 * lobe(nm, 501.1, 20.4, 26.2);
        const double y = 0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1);
        const double z = 1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8);
        const Vec3d rgb = shares[size_t(nm - film_observer::first_nm)];
        const double X = 0.4124564 * rgb.x + 0.3575761 * rgb.y + 0.1804375 * rgb.z;
        const double Y = 0.2126729 * rgb.x + 0.7151522 * rgb.y + 0.0721750 * rgb.z;
        const double Z = 0.0193339 * rgb.x + 0.1191920 * rgb.y + 0.9503041 * rgb.z;
        EXPECT_NEAR(X / (X + Y + Z), x / (x + y + z), 0.015) << nm;
        EXPECT_NEAR(Y / (X + Y + Z), y / (x + y + z), 0.015) << nm;
    }
}

/// CIE XYZ (D65) of linear RGB by its primaries x, y and its white, which Bradford's cone responses
/// adapt. Ref: SMPTE RP 177; ICC.1:2022, annex E.
Mat3 d65_from(const Chart& c) {
    const auto xyz = [](double x, double y) { return Vec3d(x / y, 1.0, (1.0 - x - y) / y); };
    Mat3 m{};
    for (size_t p = 0; p < 3; ++p) {
        const Vec3d column = xyz(c[2 * p], c[2 * p + 1]);
        for (size_t i = 0; i < 3; ++i) m[i][p] = column[int(i)];
    }
    const Vec3d parts = times(inverse(m), xyz(c[6], c[7]));
    for (auto& row : m)
        for (size_t p = 0; p < 3; ++p) row[p] *= parts[int(p)];
    constexpr Mat3 cones = {
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const Vec3d seen = times(cones, xyz(c[6], c[7])), wanted = times(cones, xyz(0.3127, 0.3290));
    Mat3 scaled = cones;
    for (size_t i = 0; i < 3; ++i)
        for (double& v : scaled[i]) v *= wanted[int(i)] / seen[int(i)];
    return times(times(inverse(cones), scaled), m);
}

struct Space {
    const char* name;
    Chart chart;
};

const Space spaces[] = {
    {"lin_rec709_scene", rec709},
    {"lin_ap1_scene", {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}},
    {"lin_ap0_scene", {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767}},
    {"lin_rec2020_scene", {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290}},
    {"lin_p3d65_scene", {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290}},
    {"lin_adobergb_scene", {0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290}}};

bool is_within(const Vec3d& color, double margin) {
    for (int c = 0; c < 3; ++c)
        if (!(color[c] > margin && color[c] < 1.0 - margin)) return false;
    return true;
}

// The spectrum is integrated by the observer, taken to the space by its primaries, and clipped
// there
TEST(ThinFilm, ColorsFollowTheWorkingSpace) {
    const FilmTables& plain = FilmTables::of_process("lin_rec709_scene");
    for (const Space& space : spaces) {
        const Mat3 from_709 = times(inverse(d65_from(space.chart)), d65_from(rec709));
        const Mat3 to_709 = inverse(from_709);
        int compared = 0;
        for (const float thickness : thicknesses) {
            FilmParameters p = film_on(1.5f, thickness, 2.2f);
            const FilmFresnel in_709(p, Rgb(0.04f), Rgb(1.0f));
            p.tables = &FilmTables::of_process(space.name);
            const FilmFresnel film(p, Rgb(0.04f), Rgb(1.0f));
            for (const double mu : cosines) {
                const Vec3d sum = spectral_sum(mu, 1.0, 2.2, {Complex(1.5)}, double(thickness));
                const Vec3d expected = times(from_709, sum);
                const Rgb got = film.at(float(mu));
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(got[c], std::clamp(expected[c], 0.0, 1.0), 1.5e-3)
                        << space.name << " " << thickness << " " << mu << " " << c;
                // Without a clamp in either space both are one color
                if (!is_within(expected, 2e-3) || !is_within(sum, 2e-3)) continue;
                ++compared;
                const Vec3d back = times(to_709, Vec3d(got));
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(back[c], double(in_709.at(float(mu))[c]), 1e-5)
                        << space.name << " " << thickness << " " << mu << " " << c;
            }
        }
        EXPECT_GT(compared, 15) << space.name;
        // Gray surfaces are not colored, light of no difference of path is white
        const FilmTables& tables = FilmTables::of_process(space.name);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(tables.spectrum.at(0.0f).cosine[c], 1.0f, 1e-6f);
        for (const float x : {0.3f, 1.1f, 2.9f}) {
            const Rgb m = tables.spectrum.at(x).cosine;
            const Vec3d back = times(to_709, Vec3d(m));
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(back[c], double(plain.spectrum.at(x).cosine[c]), 1e-6) << x;
        }
    }
}

TEST(ThinFilm, OnADielectricIsAirysSumOverTheWavelengths) {
    for (const float below : {1.2f, 1.5f, 2.4f}) {
        for (const float ior : {1.3f, 1.4f, 2.0f}) {
            for (const float above : {1.0f, 1.6f}) {
                for (const float thickness : thicknesses) {
                    FilmParameters p = film_on(below, thickness, ior);
                    p.above = above;
                    const FilmFresnel film(p, Rgb(0.04f), Rgb(1.0f));
                    for (const double mu : cosines) {
                        const Rgb expected = color(mu, double(above), double(ior),
                                                   {Complex(double(below))}, double(thickness));
                        const Rgb got = film.at(float(mu));
                        for (int c = 0; c < 3; ++c)
                            ASSERT_NEAR(got[c], expected[c], 1e-3)
                                << below << " " << ior << " " << above << " " << thickness << " "
                                << mu << " " << c;
                    }
                }
            }
        }
    }
}

TEST(ThinFilm, OnMetalIsAirysSumOverTheWavelengths) {
    const Rgb f0(0.95f, 0.64f, 0.3f), f90(1.0f, 0.9f, 0.7f);
    std::vector<Complex> below;
    for (int c = 0; c < 3; ++c) {
        const MetalIndex m = metal_index(f0[c], f0[c] + (f90[c] - f0[c]) * 0.46266438f);
        below.emplace_back(double(m.n), double(m.k));
    }
    for (const float ior : {1.4f, 2.0f}) {
        for (const float thickness : thicknesses) {
            FilmParameters p = film_on(1.5f, thickness, ior);
            p.metallic = 1;
            p.metal_f0 = f0;
            p.metal_f90 = f90;
            const FilmFresnel film(p, f0, f90);
            for (const double mu : cosines) {
                const Rgb expected = color(mu, 1.0, double(ior), below, double(thickness));
                const Rgb got = film.at(float(mu));
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(got[c], expected[c], 2e-3)
                        << ior << " " << thickness << " " << mu << " " << c;
            }
        }
    }
}

// What materials without textures read, and what means over cosines read
TEST(ThinFilm, TablesOverTheCosineAreTheSeries) {
    double worst = 0, worst_mean = 0;
    for (const float metallic : {0.0f, 0.5f, 1.0f}) {
        for (const float ior : {1.3f, 1.9f}) {
            for (const float thickness : thicknesses) {
                FilmParameters p = film_on(1.5f, thickness, ior);
                p.metallic = metallic;
                p.metal_f0 = Rgb(0.95f, 0.64f, 0.3f);
                p.metal_f90 = Rgb(1.0f, 0.9f, 0.7f);
                p.weight = 0.8f;
                FilmFresnel series(p, Rgb(0.04f), Rgb(1.0f));
                const FilmCurve curve([&](float mu) { return series.covered(mu); });
                p.curve = &curve;
                const FilmFresnel read(p, Rgb(0.04f), Rgb(1.0f));
                FilmFresnel mean = series;
                mean.prepare_means();
                constexpr int count = 1000;
                Rgb difference(0.0f);
                for (int i = 0; i < count; ++i) {
                    const float mu = (float(i) + 0.5f) / count;
                    const Rgb exact = series.at(mu), found = read.at(mu);
                    for (int c = 0; c < 3; ++c)
                        worst = std::max(worst, double(std::abs(exact[c] - found[c])));
                    difference += (mean.at_in_mean(mu) - exact) / float(count);
                    ASSERT_EQ(series.at_in_mean(mu), exact);
                }
                worst_mean = std::max(worst_mean, double(max_component(difference)));
                worst_mean = std::max(worst_mean, double(max_component(-difference)));
            }
        }
    }
    std::printf("largest difference %.2g, of means %.2g\n", worst, worst_mean);
    EXPECT_LT(worst, 5e-4);
    EXPECT_LT(worst_mean, 5e-3);
}

// An absorbing base makes colors, a white one none: all light comes back
TEST(ThinFilm, WhiteMetalStaysWhite) {
    FilmParameters p = film_on(1.5f, 0.4f);
    p.metallic = 1;
    p.metal_f0 = p.metal_f90 = Rgb(1.0f);
    const FilmFresnel film(p, Rgb(1.0f), Rgb(1.0f));
    for (const double mu : cosines) {
        const Rgb r = film.at(float(mu));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(r[c], 1.0f, 4e-3) << mu;
    }
}

TEST(ThinFilm, IndexOfMetalReflectsWhatItIsMadeOf) {
    for (const float f0 : {0.05f, 0.3f, 0.6f, 0.9f, 0.98f}) {
        for (const float share : {0.1f, 0.5f, 0.9f}) {
            // Between what n = (1 + √r)/(1 − √r) and n = (1 − r)/(1 + r) reflect aside
            const auto aside = [](const MetalIndex& m) {
                const double c = 1.0 / 7, q = double(m.n) * double(m.n) + double(m.k) * double(m.k);
                const double a = 2 * double(m.n) * c;
                return 0.5 * ((q + c * c - a) / (q + c * c + a) +
                              (q * c * c + 1 - a) / (q * c * c + 1 + a));
            };
            const double low = aside(metal_index(f0, 0.0f)), high = aside(metal_index(f0, 1.0f));
            const double wanted = low + (high - low) * double(share);
            const MetalIndex m = metal_index(f0, float(wanted));
            const Complex n(double(m.n), double(m.k));
            EXPECT_NEAR(std::norm((n - 1.0) / (n + 1.0)), double(f0), 1e-4);
            EXPECT_NEAR(aside(m), wanted, 1e-4);
            EXPECT_LT(low, high);
        }
    }
}

TEST(ThinFilm, WithoutThicknessItIsFresnelsFormula) {
    const FilmFresnel film(film_on(1.5f, 1e-6f), Rgb(0.04f), Rgb(1.0f));
    for (const double mu : cosines) {
        const double expected = double(fresnel_dielectric(float(mu), 1.5f));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(double(film.at(float(mu))[c]), expected, 2e-4);
    }
}

TEST(ThinFilm, WeightMixesWithTheBareBase) {
    FilmParameters p = film_on(1.5f, 0.5f);
    const Rgb bare0(0.04f), bare90(1.0f);
    const FilmFresnel whole(p, bare0, bare90);
    p.weight = 0.25f;
    const FilmFresnel part(p, bare0, bare90);
    for (const double mu : cosines) {
        const Rgb bare = fresnel_schlick(bare0, bare90, float(mu)), all = whole.at(float(mu));
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(part.at(float(mu))[c], bare[c] + (all[c] - bare[c]) * 0.25f, 1e-6f);
    }
}

/// Mean of f·cos / pdf of samples, per channel, with the η² of what is transmitted: what leaves of
/// light from wo.
Rgb sampled_energy(const Bsdf& bsdf, const Vec3& wo, int count = 10000) {
    Vec3d sum(0.0);
    for (int i = 0; i < count; ++i) {
        const auto part = [i](double step) { return float(std::fmod((i + 0.5) * step, 1.0)); };
        // Roberts' sequence of three dimensions
        const auto s = bsdf.sample_f(wo, part(0.8191725133961645),
                                     Vec2(part(0.6710436067037893), part(0.5497004779019702)));
        if (!s) continue;
        const double weight = double(bsdf.cosine(s->wi) / s->pdf * s->eta * s->eta) / count;
        for (int c = 0; c < 3; ++c) sum[c] += double(s->f[c]) * weight;
    }
    return Rgb(float(sum.x), float(sum.y), float(sum.z));
}

struct NamedSurface {
    std::string name;
    SurfaceParameters p;
    FilmParameters film;
    float min;  ///< energy that must be left
};

std::vector<NamedSurface> white_surfaces() {
    static const RoughInterface interface(1.5f, 0.15f, 0.15f);
    std::vector<NamedSurface> out;
    for (const float thickness : {0.15f, 0.5f}) {
        for (const float alpha : {0.0f, 0.05f, 0.3f, 1.0f}) {
            NamedSurface s{"white base", {}, film_on(1.5f, thickness, 1.9f), 0.98f};
            s.p.diffuse = Rgb(1.0f);
            s.p.alpha = alpha;
            out.push_back(s);
            s.name = "coated";
            s.p.clearcoat = 1;
            s.p.clearcoat_alpha = 0.05f;
            s.p.coat_ior = s.film.above = 1.6f;
            s.min = 0.93f;
            out.push_back(s);
            NamedSurface metal{"metal", {}, film_on(1.5f, thickness, 1.9f), 0.98f};
            metal.p.diffuse = Rgb(0.0f);
            metal.p.f0 = metal.p.f90 = Rgb(1.0f);
            metal.p.alpha = alpha;
            metal.film.metallic = 1;
            metal.film.metal_f0 = metal.film.metal_f90 = Rgb(1.0f);
            out.push_back(metal);
        }
        NamedSurface glass{"glass", {}, film_on(1.5f, thickness, 1.9f), 0.98f};
        glass.p.opacity = 0;
        glass.p.alpha = 0;
        out.push_back(glass);
        glass.name = "rough glass";
        glass.p.alpha = 0.15f;
        glass.p.interface = &interface;
        out.push_back(glass);
        glass.name = "sheet";
        glass.p.interface = nullptr;
        glass.p.alpha = 0;
        glass.p.is_thin = true;
        out.push_back(glass);
        glass.name = "rough sheet";
        glass.p.alpha = 0.15f;
        glass.p.is_thin_rough = true;
        out.push_back(glass);
    }
    return out;
}

TEST(ThinFilm, WhiteFurnaceIsNotExceeded) {
    for (NamedSurface s : white_surfaces()) {
        s.p.film = &s.film;
        for (const double mu : {1.0, 0.6, 0.3, 0.1}) {
            for (const float side : {1.0f, -1.0f}) {
                if (side < 0 && s.p.opacity == 1.0f) continue;
                const Vec3 wo = direction(mu) * side;
                const Rgb e = sampled_energy(Bsdf(s.p, up, up, wo), wo);
                for (int c = 0; c < 3; ++c) {
                    const auto where = [&] {
                        return s.name + " alpha " + std::to_string(s.p.alpha) + " thickness " +
                               std::to_string(s.film.thickness) + " cosine " +
                               std::to_string(mu * double(side)) + " channel " + std::to_string(c);
                    };
                    EXPECT_LE(e[c], 1.01f) << where();
                    EXPECT_GE(e[c], s.min) << where();
                }
            }
        }
    }
}

TEST(ThinFilm, Reciprocity) {
    sampling::testing::TestRandom random(5);
    for (NamedSurface s : white_surfaces()) {
        // Without blur reflections from the inside are not reciprocal (README)
        if (s.p.opacity < 1.0f && s.p.interface == nullptr) continue;
        s.p.film = &s.film;
        for (int i = 0; i < 100; ++i) {
            const Vec3 a =
                direction(0.02 + 0.98 * double(random.uniform()), 6 * double(random.uniform()));
            Vec3 b =
                direction(0.02 + 0.98 * double(random.uniform()), 6 * double(random.uniform()));
            const bool passes = s.p.opacity < 1.0f && i % 2 == 1;
            if (passes) b = -b;
            // Of the other side with its η²
            const BsdfValue there = Bsdf(s.p, up, up, a).evaluate(a, b);
            const BsdfValue back = Bsdf(s.p, up, up, b).evaluate(b, a);
            for (int c = 0; c < 3; ++c) {
                const double f = double(there.f()[c]) * double(there.eta * there.eta);
                EXPECT_NEAR(f, double(back.f()[c]), 1e-5 + 1e-3 * f) << s.name;
            }
        }
    }
}

TEST(ThinFilm, MirrorsReflectTheClosedForm) {
    SurfaceParameters p;
    p.opacity = 0;
    p.alpha = 0;
    const FilmParameters film = film_on(1.5f, 0.35f, 1.8f);
    p.film = &film;
    for (const double mu : {0.9, 0.4}) {
        const Vec3 wo = direction(mu);
        const Bsdf bsdf(p, up, up, wo);
        const auto reflected = bsdf.delta(ScatterKind::Reflect);
        const auto passed = bsdf.delta(ScatterKind::Transmit);
        ASSERT_TRUE(reflected && passed);
        const Rgb expected = color(mu, 1.0, 1.8, {Complex(1.5)}, 0.35);
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(reflected->weight[c], expected[c], 1e-3f);
            EXPECT_NEAR(passed->weight[c] * passed->eta * passed->eta, 1.0f - expected[c], 1e-3f);
        }
        EXPECT_GT(max_component(reflected->weight) - reflected->weight.y, 0.005f) << "no color";
    }
}

}  // namespace
}  // namespace velatura::shading
