// SPDX-License-Identifier: Apache-2.0
// Dispersive solids: Snell's law by the wavelength, light that is neither gained nor lost, and ways
// to find caustics that agree.
#include "shading/dispersion.h"

#include "shading/thin_film.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace velatura::test {

namespace {

constexpr float abbe_number = 12.0f;

scene::Material dispersive_glass(float ior = 1.5f, float abbe = abbe_number) {
    scene::Material m = smooth_glass(ior);
    m.dispersion = 1.0f / abbe;
    return m;
}

/// Cauchy's formula by the Abbe number. nm: nanometers. Ref: OpenPBR 1.1, "Translucent base".
double cauchy(double nm, double index, double abbe) {
    const double f = 486.1, d = 587.6, c = 656.3;
    const double b = (index - 1.0) / (abbe * (1.0 / (f * f) - 1.0 / (c * c)));
    return index + b * (1.0 / (nm * nm) - 1.0 / (d * d));
}

/// Dominant wavelengths of red, green and blue [nm].
struct Peaks {
    double red = 611.4, green = 549.1, blue = 464.2;
};

constexpr Peaks acescg = {628.7, 532.9, 467.4};

/// Mean of g(wavelength in nm) over a channel's band: densest at the second of three wavelengths.
double band_mean(int channel, const std::function<double(double)>& g, const Peaks& p = {}) {
    const double bands[3][3] = {
        {p.green, p.red, 680.0}, {p.blue, p.green, p.red}, {420.0, p.blue, p.green}};
    const double *b = bands[channel], step = 0.05;
    double sum = 0, weights = 0;
    for (double nm = b[0] + step / 2; nm < b[2]; nm += step) {
        const double w = nm < b[1] ? (nm - b[0]) / (b[1] - b[0]) : (b[2] - nm) / (b[2] - b[1]);
        sum += w * g(nm);
        weights += w;
    }
    return sum / weights;
}

double reflectance(double cosine, double index) {
    const double f0 = std::pow((index - 1.0) / (index + 1.0), 2);
    return f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5);
}

void add_quad(TestScene& test, const std::vector<Vec3>& corners, scene::MaterialId material) {
    scene::Mesh mesh;
    mesh.points = corners;
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    test.scene.shapes.push_back(shape);
}

constexpr double wedge = 0.5;  ///< radians between the faces of the prism

/// Where light along −z that goes through the prism meets the plane z = −10.
double shift(double index) {
    const double s = std::sin(wedge), c = std::cos(wedge);
    const double out = std::sqrt(1.0 - index * index * s * s);
    const double x = -index * c * s + out * s, z = -index * s * s - out * c;
    return -8.0 / z * x;
}

/// A prism whose first face is across the ray and whose second is tilted, and a wall that shines
/// where x is below `edge`.
TestScene behind_prism(const scene::Material& glass, double edge) {
    TestScene test;
    const scene::MaterialId material = test.add_material(glass);
    add_quad(test, {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}}, material);
    const float t = float(std::tan(wedge));
    // Faces away from the camera
    add_quad(test, {{-1, -1, -2 - t}, {-1, 1, -2 - t}, {1, 1, -2 + t}, {1, -1, -2 + t}}, material);
    const float e = float(edge);
    add_quad(test, {{-50, -50, -10}, {e, -50, -10}, {e, 50, -10}, {-50, 50, -10}},
             test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    test.look_at_point(1e-4);
    return test;
}

}  // namespace

TEST(Dispersion, WavelengthsHaveTheirDensityAndIndex) {
    using namespace shading;
    using namespace dispersion_lines;
    const float n = 1.6f, v = 30.0f;
    const auto index = [&](float um) { return dispersed_index(n, 1.0f / v, spread_of(um)); };
    EXPECT_FLOAT_EQ(index(yellow_d), n);
    EXPECT_NEAR((n - 1.0f) / (index(blue_f) - index(red_c)), v, 1e-3f);
    EXPECT_NEAR(double(index(0.45f)), cauchy(450, double(n), double(v)), 1e-5);
    constexpr int count = 20000;
    const std::pair<const char*, Peaks> spaces[] = {{"lin_rec709_scene", {}},
                                                    {"lin_ap1_scene", acescg},
                                                    {"lin_ap0_scene", {680, 520.8, 472.9}}};
    for (const auto& [space, peaks] : spaces) {
        for (int channel = 0; channel < 3; ++channel) {
            const WavelengthBand band = wavelength_bands(space)[size_t(channel)];
            double sum = 0, below = 0;
            const double peak = 1e3 * double(band.peak);
            for (int i = 0; i < count; ++i) {
                const double nm = 1e3 * double(sample_wavelength(band, (float(i) + 0.5f) / count));
                sum += nm / count;
                below += nm < peak ? 1.0 / count : 0.0;
            }
            const auto is_below = [&](double nm) { return nm < peak ? 1.0 : 0.0; };
            EXPECT_NEAR(sum,
                        band_mean(
                            channel, [](double nm) { return nm; }, peaks),
                        0.02)
                << space << " " << channel;
            EXPECT_NEAR(below, band_mean(channel, is_below, peaks), 1e-3)
                << space << " " << channel;
        }
    }
}

// The bands are densest where the ray from white through the primary meets the spectral locus
TEST(Dispersion, BandsAreAtTheDominantWavelengthsOfThePrimaries) {
    struct Primaries {
        const char* space;
        double xy[3][2];
        double white[2];
    };

    constexpr Primaries spaces[] = {
        {"lin_rec709_scene", {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}}, {0.3127, 0.3290}},
        {"lin_ap1_scene", {{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}}, {0.32168, 0.33767}},
        {"lin_ap0_scene", {{0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.077}}, {0.32168, 0.33767}},
        {"lin_rec2020_scene", {{0.708, 0.292}, {0.17, 0.797}, {0.131, 0.046}}, {0.3127, 0.3290}},
        {"lin_p3d65_scene", {{0.68, 0.32}, {0.265, 0.69}, {0.15, 0.06}}, {0.3127, 0.3290}},
        {"lin_adobergb_scene", {{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}}, {0.3127, 0.3290}}};
    const std::vector<Vec3d> shares = shading::film_observer::shares();
    for (const Primaries& p : spaces) {
        for (int c = 0; c < 3; ++c) {
            const double wanted = std::atan2(p.xy[c][1] - p.white[1], p.xy[c][0] - p.white[0]);
            double nearest = 10, found = 0;
            for (int nm = 410; nm <= 690; ++nm) {
                const Vec3d& rgb = shares[size_t(nm - shading::film_observer::first_nm)];
                const double x = 0.4124564 * rgb.x + 0.3575761 * rgb.y + 0.1804375 * rgb.z;
                const double y = 0.2126729 * rgb.x + 0.7151522 * rgb.y + 0.0721750 * rgb.z;
                const double z = 0.0193339 * rgb.x + 0.1191920 * rgb.y + 0.9503041 * rgb.z;
                const double angle =
                    std::atan2(y / (x + y + z) - p.white[1], x / (x + y + z) - p.white[0]);
                const double off = std::abs(std::remainder(angle - wanted, 2 * pi_d));
                if (off < nearest) nearest = off, found = nm;
            }
            // Light ends before the red of ACES2065-1; the table of the observer is one of 10 nm
            const double peak = 1e3 * double(shading::wavelength_bands(p.space)[size_t(c)].peak);
            EXPECT_NEAR(peak, std::min(found, 680.0), 2.5) << p.space << " " << c;
        }
    }
    // Names of no RGB space have those of Rec.709
    EXPECT_EQ(shading::wavelength_bands("")[0].peak, 0.6114f);
}

TEST(Dispersion, PrismTurnsEachWavelengthBySnellsLaw) {
    const double index = 1.5, red = shift(cauchy(620, index, double(abbe_number))),
                 blue = shift(cauchy(460, index, double(abbe_number)));
    ASSERT_GT(std::abs(red - blue), 0.2);
    for (const double t : {0.1, 0.5, 0.9, 0.3, 0.7}) {
        const double edge = red + (blue - red) * t;
        TestScene test = behind_prism(dispersive_glass(), edge);
        const bool is_wide = t == 0.3 || t == 0.7;
        if (is_wide) test.scene.settings.working_space = "lin_ap1_scene";
        const Peaks peaks = is_wide ? acescg : Peaks();
        const RenderedLayers layers = render(test, {.size = 16, .samples = 512});
        for (int c = 0; c < 3; ++c) {
            const double expected = band_mean(
                c,
                [&](double nm) {
                    const double n = cauchy(nm, index, double(abbe_number));
                    const double out = std::sqrt(1.0 - std::pow(n * std::sin(wedge), 2));
                    const double passed =
                        (1.0 - reflectance(1.0, index)) * (1.0 - reflectance(out, index));
                    return shift(n) < edge ? passed : 0.0;
                },
                peaks);
            const Estimate e = layers.bounce(2, -1, c);
            EXPECT_NEAR(e.mean, expected, 4.0 * e.standard_error + 2e-3)
                << "edge " << edge << " channel " << c;
            EXPECT_LT(e.standard_error, 0.02);
        }
    }
    // Without dispersion all channels go one way
    const double edge = 0.5 * (shift(1.5) + shift(1.49));
    const RenderedLayers one =
        render(behind_prism(smooth_glass(1.5f), edge), {.size = 4, .samples = 64});
    EXPECT_TRUE(one.bounce(2, -1, 0).mean == one.bounce(2, -1, 2).mean);
}

// Whatever way light takes, white surroundings look as they do without dispersion
TEST(Dispersion, UniformSurroundingsStayAsTheyAre) {
    const auto compare = [](bool is_rough, const char* space) {
        const auto ball = [&](scene::Material glass, uint64_t samples) {
            if (is_rough) {
                glass.roughness = scene::Input(0.4f);
                glass.rough_transmission = true;
            }
            TestScene test;
            test.add_sphere(Vec3(0, 0, -4), 1.0, test.add_material(glass));
            test.add_light(scene::LightKind::Dome, Mat4d());
            test.look_with_perspective(0.2);
            test.scene.settings.working_space = space;
            return render(test, {.size = 24, .samples = samples, .last_bounce = 8});
        };
        const RenderedLayers plain = ball(smooth_glass(1.5f), 64);
        const RenderedLayers layers = ball(dispersive_glass(1.5f, 9.0f), 128);
        for (int c = 0; c < 3; ++c) {
            const Estimate e = layers.beauty(c), expected = plain.beauty(c);
            EXPECT_NEAR(e.mean, expected.mean,
                        4.0 * std::hypot(e.standard_error, expected.standard_error) + 5e-3)
                << (is_rough ? "rough" : "smooth") << " ball, channel " << c << " in " << space;
            EXPECT_LT(e.standard_error, 0.02);
        }
    };
    compare(true, "lin_rec709_scene");
    for (const char* space : {"lin_rec709_scene", "lin_ap1_scene", "lin_ap0_scene",
                              "lin_rec2020_scene", "lin_p3d65_scene", "lin_adobergb_scene"})
        compare(false, space);
}

// A patch under a slab and a disk: paths, and what manifold sampling leaves to them
TEST(Dispersion, PathsThroughASlabHaveTheClosedForm) {
    constexpr double bottom = 0.25, top = 0.75, height = 2.0, radius = 0.9, patch_z = -1.0;
    double expected[3];
    for (int c = 0; c < 3; ++c) {
        expected[c] = band_mean(c, [&](double nm) {
            // Few wavelengths are enough for what changes little
            static double last_nm = -1, last = 0;
            if (std::abs(nm - last_nm) < 8.0) return last;
            const double n = cauchy(nm, 1.8, double(abbe_number));
            constexpr int steps = 4000;
            double sum = 0;
            for (int i = 0; i < steps; ++i) {
                const double theta = 0.4 * (i + 0.5) / steps, s = std::sin(theta),
                             cosine = std::cos(theta);
                const double inside = std::sqrt(1.0 - s * s / (n * n));
                const double aside = (height - top + bottom - patch_z) * s / cosine +
                                     (top - bottom) * (s / n) / inside;
                if (aside < radius)
                    sum +=
                        std::pow(1.0 - reflectance(cosine, n), 2) * 2.0 * s * cosine * 0.4 / steps;
            }
            last_nm = nm;
            last = sum;
            return sum;
        });
    }
    for (const integrator::Caustics way :
         {integrator::Caustics::Path, integrator::Caustics::Manifold}) {
        TestScene test;
        test.add_square(float(patch_z), 0.01f, test.add_matte(Rgb(1.0f)));
        const scene::MaterialId glass = test.add_material(dispersive_glass(1.8f));
        test.add_square(float(top), 4.0f, glass);
        test.add_square(float(bottom), 4.0f, glass);
        test.scene.shapes.back().flip_normals = true;
        test.add_light(scene::LightKind::Disk, at(Vec3d(0, 0, height))).radius = float(radius);
        const RenderedLayers layers =
            render(test, {.size = 16, .samples = 160, .last_bounce = 6, .caustics = way});
        for (int c = 0; c < 3; ++c)
            expect_close(layers.bounce(3, 0, c), expected[c], 0.25,
                         fmt::format("way {}, channel {}", int(way), c));
    }
}

}  // namespace velatura::test
