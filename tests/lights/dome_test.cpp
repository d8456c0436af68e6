// SPDX-License-Identifier: Apache-2.0
#include "light_fixtures.h"
#include "lights/environment_map.h"
#include "lights/light_selector.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::lights {
namespace {

using scene::LightKind;

EnvironmentImage image_of(int width, int height, const Rgb& fill = Rgb(0.0f)) {
    EnvironmentImage image{width, height, {}};
    image.texels.assign(size_t(width) * size_t(height), fill);
    return image;
}

Rgb& texel(EnvironmentImage& image, int x, int y) {
    return image.texels[size_t(y) * size_t(image.width) + size_t(x)];
}

ImageLoader loader_of(const EnvironmentImage& image) {
    return [image](const scene::Light&) { return Result<EnvironmentImage>(image); };
}

scene::Light textured(LightKind kind, const Mat4d& m = Mat4d()) {
    scene::Light light = light_of(kind, m);
    light.texture_file = "picture.exr";
    return light;
}

/// A smooth sky, some noise, and a sun of four texels.
EnvironmentImage sky(float sun) {
    EnvironmentImage image = image_of(64, 32);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x)
            texel(image, x, y) = Rgb(0.2f + 0.02f * float(32 - y) + 0.3f * float((x * 7 + y) % 5));
    for (int y = 9; y < 11; ++y)
        for (int x = 20; x < 22; ++x) texel(image, x, y) = Rgb(sun);
    return image;
}

/// Irradiance of a map for normal n (dome space) by midpoint quadrature, 16 × 16 points per texel.
double quadrature(const EnvironmentMap& map, int width, int height, const Vec3d& n) {
    const int nx = 16 * width, ny = 16 * height;
    double sum = 0;
    for (int j = 0; j < ny; ++j) {
        const double theta = pi_d * (j + 0.5) / ny;
        for (int i = 0; i < nx; ++i) {
            const double longitude = 2 * pi_d * (0.5 - (i + 0.5) / nx);
            const Vec3d d(std::sin(theta) * std::sin(longitude), std::cos(theta),
                          std::sin(theta) * std::cos(longitude));
            sum += double(map.view(d).radiance.x) * std::max(0.0, n.dot(d)) * std::sin(theta);
        }
    }
    return sum * 2 * pi_d * pi_d / (double(nx) * ny);
}

TEST(EnvironmentMap, ConstantMapGivesPi) {
    for (const bool compensate : {false, true}) {
        const EnvironmentMap map(image_of(128, 64, Rgb(1.0f)), compensate);
        const Estimate e = integrate(8192, [&](const Vec2& u) {
            const auto s = map.sample(u);
            return s ? std::max(0.0, s->direction.z) * double(s->radiance.x) / s->pdf : 0.0;
        });
        EXPECT_NEAR(e.mean, pi_d, 1e-4 * pi_d) << "detectable " << e.detectable();
        EXPECT_LE(e.detectable(), 5e-4);
    }
}

TEST(EnvironmentMap, SunAndSkyAgreeWithQuadrature) {
    for (const float sun : {50.0f, 1e5f, 6.4e10f}) {
        const EnvironmentMap map(sky(sun), false);
        const Vec3d n(0.48, 0.6, 0.64);
        const double expected = quadrature(map, 64, 32, n);
        const Estimate e = integrate(8192, [&](const Vec2& u) {
            const auto s = map.sample(u);
            return s ? std::max(0.0, n.dot(s->direction)) * double(s->radiance.x) / s->pdf : 0.0;
        });
        EXPECT_NEAR(e.mean, expected, 1e-4 * expected + 4 * e.standard_error)
            << "detectable " << e.detectable() / expected;
        EXPECT_LE(e.standard_error, 2e-4 * expected);
    }
}

TEST(EnvironmentMap, DensityIntegratesToOneAndMatchesItsSamples) {
    for (const bool compensate : {false, true}) {
        const EnvironmentMap map(sky(30.0f), compensate);
        const int nx = 1024, ny = 512;
        double sum = 0;
        for (int j = 0; j < ny; ++j) {
            const double theta = pi_d * (j + 0.5) / ny;
            for (int i = 0; i < nx; ++i) {
                const double a = 2 * pi_d * (i + 0.5) / nx;
                sum += std::sin(theta) * map.view({std::sin(theta) * std::sin(a), std::cos(theta),
                                                   std::sin(theta) * std::cos(a)})
                                             .pdf;
            }
        }
        EXPECT_NEAR(sum * 2 * pi_d * pi_d / (double(nx) * ny), 1.0, 1e-5);

        // Share of the samples per block of directions against the integral of the density there
        constexpr int blocks = 8, count = 1 << 16;
        std::vector<double> found(blocks * blocks), expected(blocks * blocks);
        for (int i = 0; i < count; ++i) {
            const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
            const auto s = map.sample(sampler.get_2d(0, sampling::Purpose::LightSurface));
            ASSERT_TRUE(s);
            EXPECT_NEAR(s->pdf, map.view(s->direction).pdf, 1e-6 * s->pdf);
            const double v = std::acos(s->direction.y) / pi_d;
            const double u = 0.5 - std::atan2(s->direction.x, s->direction.z) / (2 * pi_d);
            const int bx = std::min(int(u * blocks), blocks - 1);
            found[size_t(std::min(int(v * blocks), blocks - 1) * blocks + bx)] += 1.0 / count;
        }
        for (int j = 0; j < ny; ++j) {
            const double theta = pi_d * (j + 0.5) / ny;
            for (int i = 0; i < nx; ++i) {
                const double u = (i + 0.5) / nx, a = 2 * pi_d * (0.5 - u);
                const double p = map.view({std::sin(theta) * std::sin(a), std::cos(theta),
                                           std::sin(theta) * std::cos(a)})
                                     .pdf;
                const size_t block = size_t((j * blocks / ny) * blocks + i * blocks / nx);
                expected[block] += p * std::sin(theta) * 2 * pi_d * pi_d / (double(nx) * ny);
            }
        }
        for (size_t i = 0; i < found.size(); ++i)
            EXPECT_NEAR(found[i], expected[i], 3e-4) << "block " << i;
    }
}

TEST(EnvironmentMap, RadianceOverDensityIsSmoothForGrayMaps) {
    // The density follows the interpolated radiance. What is left is the sine inside a row of
    // texels: at most the quotient of two rows' sines, 1 + (π/32) · cotθ, next to the sun's edge
    const EnvironmentMap map(sky(1e4f), false);
    double smallest = 1e300, largest = 0;
    for (int i = 0; i < 4096; ++i) {
        const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
        const auto s = map.sample(sampler.get_2d(0, sampling::Purpose::LightSurface));
        ASSERT_TRUE(s);
        const double ratio = double(s->radiance.x) / s->pdf;
        if (std::abs(s->direction.y) > 0.9) continue;
        smallest = std::min(smallest, ratio);
        largest = std::max(largest, ratio);
    }
    EXPECT_LT(largest / smallest, 1.2);
}

TEST(EnvironmentMap, BlackMapIsNeverSampled) {
    const EnvironmentMap map(image_of(8, 4), true);
    EXPECT_TRUE(map.is_black());
    EXPECT_FALSE(map.sample({0.5f, 0.5f}));
}

TEST(DomeLight, LatlongIsOrientedAsTheSchemaSays) {
    struct Case {
        int x, y;
        Vec3 direction;
    };

    // 16 × 8 texels: bright pairs around u = 1/2 (long 0, +Z), 1/4 (+90, +X), 0 (±180, −Z), 3/4
    // (−X)
    const Case cases[] = {
        {7, 3, {0, 0, 1}}, {3, 3, {1, 0, 0}}, {15, 3, {0, 0, -1}}, {11, 3, {-1, 0, 0}}};
    for (const Case& c : cases) {
        EnvironmentImage image = image_of(16, 8);
        for (int dy = 0; dy < 2; ++dy)
            for (int dx = 0; dx < 2; ++dx) texel(image, (c.x + dx) % 16, c.y + dy) = Rgb(1.0f);
        const scene::Scene scene = scene_of({textured(LightKind::Dome)});
        Diagnostics diagnostics;
        const LightSet lights(scene, loader_of(image), diagnostics);
        EXPECT_NEAR(lights.intersect(0, Vec3(0.0f), c.direction)->Le.x, 1.0f, 1e-5f);
        EXPECT_EQ(lights.intersect(0, Vec3(0.0f), -c.direction)->Le.x, 0.0f);
    }
    EnvironmentImage top = image_of(16, 8);
    for (int x = 0; x < 16; ++x) texel(top, x, 0) = Rgb(1.0f);
    // Pole +Y of the light, turned to world +Z by its transform, whatever its scale
    const Mat4d turned = matrix_of({3, 0, 0}, {0, 0, 3}, {0, -3, 0}, {9, 9, 9});
    const scene::Scene scene = scene_of({textured(LightKind::Dome, turned)});
    Diagnostics diagnostics;
    const LightSet lights(scene, loader_of(top), diagnostics);
    EXPECT_EQ(lights.background({0, 0, 1}).x, 1.0f);
    EXPECT_EQ(lights.background({0, 0, -1}).x, 0.0f);
    EXPECT_EQ(diagnostics.warning_count(), 0u);
}

TEST(DomeLight, MirroredTransformMirrorsTheImage) {
    EnvironmentImage image = image_of(16, 8);
    for (int y = 0; y < 8; ++y) texel(image, 3, y) = texel(image, 4, y) = Rgb(1.0f);  // +X
    const Mat4d mirrored = matrix_of({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0});
    const scene::Scene scene = scene_of({textured(LightKind::Dome, mirrored)});
    Diagnostics diagnostics;
    const LightSet lights(scene, loader_of(image), diagnostics);
    EXPECT_NEAR(lights.background({-1, 0, 0}).x, 1.0f, 1e-5f);
    EXPECT_EQ(lights.background({1, 0, 0}).x, 0.0f);
    const auto s = lights.sample(0, Vec3(0.0f), {0.4f, 0.6f});
    ASSERT_TRUE(s);
    EXPECT_LT(s->wi.x, 0.0f);
}

TEST(DomeLight, ScaledAndShearedTransformsAreNamed) {
    const Mat4d sheared = matrix_of({1, 0, 0}, {0.5, 1, 0}, {0, 0, 2}, {0, 0, 0});
    scene::Scene scene = scene_of({textured(LightKind::Dome, sheared)});
    scene.lights[0].shaping.is_active = true;
    Diagnostics diagnostics;
    const LightSet lights(scene, loader_of(image_of(4, 2, Rgb(1.0f))), diagnostics);
    EXPECT_TRUE(lights.is_on(0));
    ASSERT_EQ(diagnostics.all().size(), 2u);
    EXPECT_NE(diagnostics.all()[0].message.find("shaping"), std::string::npos);
    EXPECT_NE(diagnostics.all()[1].message.find("shear"), std::string::npos);
}

TEST(DomeLight, SamplesPointWhereRaysFindTheSameRadiance) {
    const Mat4d turned = matrix_of({0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}, {0, 0, 0});
    const scene::Scene scene = scene_of({textured(LightKind::Dome, turned)});
    Diagnostics diagnostics;
    const LightSet lights(scene, loader_of(sky(1000.0f)), diagnostics);
    for (int i = 0; i < 2000; ++i) {
        const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
        const auto s = lights.sample(0, Vec3(0.0f), sampler.get_2d(0, sampling::Purpose::Lens));
        ASSERT_TRUE(s);
        const auto hit = lights.intersect(0, Vec3(0.0f), s->wi);
        // Next to the sun the radiance changes by its height within a texel
        EXPECT_NEAR(hit->Le.x, s->Le.x, 1e-4f * s->Le.x + 0.01f);
        EXPECT_NEAR(hit->pdf, s->pdf, 1e-3f * s->pdf + 1e-5f);
    }
}

TEST(DomeLight, CompensatedSamplingPlusUniformSamplingKeepsTheIrradiance) {
    const scene::Scene scene = scene_of({textured(LightKind::Dome)});
    Diagnostics diagnostics;
    LightSetOptions options;
    options.compensate_mis = true;
    const LightSet lights(scene, loader_of(sky(100.0f)), diagnostics, options);
    const Vec3 n(0.48f, 0.6f, 0.64f);
    const double expected = quadrature(EnvironmentMap(sky(100.0f), false), 64, 32, Vec3d(n));
    const double other = 1.0 / (4.0 * pi_d);
    const Estimate e = integrate(16384, [&](const Vec2& u) {
        double sum = 0;
        const auto s = lights.sample(0, Vec3(0.0f), u);
        if (s)
            sum += double(s->Le.x) * std::max(0.0, double(n.dot(s->wi))) / (double(s->pdf) + other);
        const Vec3 d = uniform_direction(u);
        const auto hit = lights.intersect(0, Vec3(0.0f), d);
        return sum +
               double(hit->Le.x) * std::max(0.0, double(n.dot(d))) / (double(hit->pdf) + other);
    });
    EXPECT_NEAR(e.mean, expected, 4 * e.standard_error + 1e-4 * expected)
        << "detectable " << e.detectable() / expected;
    EXPECT_LE(e.standard_error, 1e-3 * expected);
}

TEST(DomeLight, SampledShareIsWhatExceedsTheMean) {
    // 1 + cosθ has the mean 1 over the sphere, and ½ ∫ max(0, cosθ) d(cosθ) = 1/4 of it lies above
    const int width = 256, height = 512;
    EnvironmentImage image = image_of(width, height, Rgb(1.0f));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.texels[size_t(y * width + x)] =
                Rgb(float(1.0 + std::cos(pi_d * (y + 0.5) / height)));
    EXPECT_NEAR(EnvironmentMap(image, true).sampled_share(), 0.25, 1e-4);
    EXPECT_EQ(EnvironmentMap(image, false).sampled_share(), 1.0);
    EXPECT_EQ(EnvironmentMap(image_of(64, 32, Rgb(3.0f)), true).sampled_share(), 0.0);
}

TEST(DomeLight, TheTreeLeavesEvenSkiesToTheBsdfUnderCompensation) {
    scene::Light sun = light_of(LightKind::Distant);
    const scene::Scene scene = scene_of({light_of(LightKind::Dome), sun});
    for (const bool compensate : {false, true}) {
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics, {.compensate_mis = compensate});
        const auto tree = make_light_selector(lights, Box3(Vec3(-1.0f), Vec3(1.0f)));
        const Receiver at{Vec3(0.0f), Vec3(0.0f, 1.0f, 0.0f)};
        EXPECT_EQ(tree->is_single(), compensate);
        EXPECT_EQ(tree->pmf(at, 0) > 0.0f, !compensate);
        EXPECT_GT(tree->pmf(at, 1), 0.0f);
        for (const double u : {0.0, 0.3, 0.7, 0.999}) {
            const auto choice = tree->select(at, u);
            ASSERT_TRUE(choice);
            EXPECT_EQ(choice->pmf, tree->pmf(at, choice->light));
            EXPECT_TRUE(!compensate || choice->light.index == 1);
        }
    }
}

TEST(DomeLight, OtherLayoutsShowTheSameDirections) {
    // Paint each layout by direction, convert, compare: the color of a direction is (d + 1) / 2
    const auto color = [](const Vec3d& d) {
        return Rgb(float(0.5 * d.x + 0.5), float(0.5 * d.y + 0.5), float(0.5 * d.z + 0.5));
    };
    const int size = 128;
    for (const scene::DomeFormat format :
         {scene::DomeFormat::Angular, scene::DomeFormat::MirrorBall}) {
        EnvironmentImage image = image_of(size, size);
        for (int y = 0; y < size; ++y) {
            for (int x = 0; x < size; ++x) {
                const double px = 2 * (x + 0.5) / size - 1, py = 1 - 2 * (y + 0.5) / size;
                const double r = std::sqrt(px * px + py * py);
                const bool is_angular = format == scene::DomeFormat::Angular;
                const double angle = is_angular ? pi_d * r : 2 * std::asin(std::min(r, 1.0));
                const double s = std::sin(angle) / r;
                texel(image, x, y) = color({px * s, py * s, -std::cos(angle)});
            }
        }
        const EnvironmentMap map(to_latlong(image, format), false);
        // Near +Z, the rim of the image, a mirrored ball has hardly any texels
        for (const Vec3d& d : {Vec3d(0, 0, -1), Vec3d(1, 0, 0), Vec3d(0, 1, 0),
                               Vec3d(0, -0.8, -0.6), Vec3d(-0.6, 0.48, 0.64)}) {
            const Rgb found = map.view(d).radiance, expected = color(d);
            for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], 0.03f);
        }
    }
    // What lies beyond the disk has no direction, and no part in those at the rim, which show +Z
    for (const scene::DomeFormat format :
         {scene::DomeFormat::Angular, scene::DomeFormat::MirrorBall}) {
        EnvironmentImage image = image_of(size, size);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const double px = 2 * (x + 0.5) / size - 1, py = 1 - 2 * (y + 0.5) / size;
                texel(image, x, y) = Rgb(px * px + py * py <= 1.0 ? 1.0f : 0.0f);
            }
        const EnvironmentImage converted = to_latlong(image, format);
        for (const Rgb& found : converted.texels) EXPECT_NEAR(found.x, 1.0f, 1e-6f);
    }
    // Six faces of one color each
    EnvironmentImage cross = image_of(48, 64);
    const auto paint = [&](int column, int row, const Rgb& c) {
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) texel(cross, 16 * column + x, 16 * row + y) = c;
    };
    paint(1, 0, Rgb(0, 1, 0));
    paint(0, 1, Rgb(-1, 0, 0) * -0.5f);
    paint(1, 1, Rgb(0, 0, 1));
    paint(2, 1, Rgb(1, 0, 0));
    paint(1, 2, Rgb(0, 0.5f, 0));
    paint(1, 3, Rgb(0, 0, 0.5f));
    const EnvironmentMap map(to_latlong(cross, scene::DomeFormat::CubeMapVerticalCross), false);
    EXPECT_NEAR(map.view({0, 1, 0}).radiance.y, 1.0f, 1e-5f);
    EXPECT_NEAR(map.view({0, -1, 0}).radiance.y, 0.5f, 1e-5f);
    EXPECT_NEAR(map.view({1, 0, 0}).radiance.x, 1.0f, 1e-5f);
    EXPECT_NEAR(map.view({-1, 0, 0}).radiance.x, 0.5f, 1e-5f);
    EXPECT_NEAR(map.view({0, 0, 1}).radiance.z, 1.0f, 1e-5f);
    EXPECT_NEAR(map.view({0, 0, -1}).radiance.z, 0.5f, 1e-5f);
}

TEST(RectLight, TextureReadsUprightFromTheLitSide) {
    EnvironmentImage image = image_of(2, 2);
    texel(image, 0, 0) = Rgb(1, 2, 3);  // upper left
    texel(image, 1, 0) = Rgb(4, 5, 6);
    texel(image, 0, 1) = Rgb(7, 8, 9);
    texel(image, 1, 1) = Rgb(10, 11, 12);
    const scene::Scene scene = scene_of({textured(LightKind::Rect, translation(0, 0, 1))});
    Diagnostics diagnostics;
    const LightSet lights(scene, loader_of(image), diagnostics);
    // A viewer below the light looks along +Z with +Y up: +X is on the left
    EXPECT_EQ(lights.intersect(0, {0.3f, 0.3f, 0}, {0, 0, 1})->Le, Rgb(1, 2, 3));
    EXPECT_EQ(lights.intersect(0, {-0.3f, 0.3f, 0}, {0, 0, 1})->Le, Rgb(4, 5, 6));
    EXPECT_EQ(lights.intersect(0, {0.3f, -0.3f, 0}, {0, 0, 1})->Le, Rgb(7, 8, 9));
    EXPECT_EQ(lights.intersect(0, {-0.3f, -0.3f, 0}, {0, 0, 1})->Le, Rgb(10, 11, 12));
    EXPECT_NEAR(lights.intersect(0, {0, 0, 0}, {0, 0, 1})->Le.x, 5.5f, 1e-5f);
}

TEST(LightSet, UnreadableAndBrokenTexturesAreNamedInWarnings) {
    scene::Scene scene = scene_of({textured(LightKind::Dome), textured(LightKind::Rect)});
    scene.lights[1].name = "/Rect";
    Diagnostics diagnostics;
    const LightSet lights(
        scene,
        [](const scene::Light&) {
            return Result<EnvironmentImage>(Error{"io", "no file"});
        },
        diagnostics);
    EXPECT_TRUE(lights.is_on(0) && lights.is_on(1));
    EXPECT_EQ(lights.background({0, 1, 0}), Rgb(1.0f));
    ASSERT_EQ(diagnostics.all().size(), 2u);
    EXPECT_EQ(diagnostics.all()[0].code, "light-texture");
    EXPECT_NE(diagnostics.all()[0].message.find("no file"), std::string::npos);

    EnvironmentImage image = sky(1.0f);
    texel(image, 3, 3) = Rgb(NAN);
    texel(image, 4, 3) = Rgb(-1.0f);
    texel(image, 5, 3) = Rgb(INFINITY);
    Diagnostics more;
    const LightSet cleaned(scene, loader_of(image), more);
    EXPECT_NE(more.all()[0].message.find("3 texels"), std::string::npos);
    for (int i = 0; i < 500; ++i) {
        const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
        const auto s = cleaned.sample(0, Vec3(0.0f), sampler.get_2d(0, sampling::Purpose::Lens));
        EXPECT_TRUE(s && is_finite(s->Le));
    }
}

}  // namespace
}  // namespace velatura::lights
