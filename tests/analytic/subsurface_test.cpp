// SPDX-License-Identifier: Apache-2.0
// Light that scatters below surfaces, against the exact albedo of half spaces, and furnaces.
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace velatura::test {

namespace {

using integrator::LightSampling;

scene::Material wax(const Rgb& color, const Rgb& radius, float anisotropy = 0.0f) {
    scene::Material m;
    m.has_specular = false;
    m.diffuse_color = scene::Input(color);
    m.subsurface = scene::Input(1.0f);
    m.subsurface_radius = scene::Input(radius);
    m.subsurface_anisotropy = anisotropy;
    return m;
}

/// Albedo of a half space that scatters evenly, under diffuse light: by Chandrasekhar's H function,
/// 1/H(μ) = √(1 − α) + α/2 ∫ μ' H(μ') / (μ + μ') dμ'.
double exact_albedo(double alpha) {
    constexpr int n = 400;
    std::vector<double> mu(n), h(n, 1.0);
    for (int i = 0; i < n; ++i) mu[size_t(i)] = (i + 0.5) / n;
    for (int pass = 0; pass < 400; ++pass) {
        for (size_t i = 0; i < n; ++i) {
            double integral = 0;
            for (size_t k = 0; k < n; ++k) integral += mu[k] * h[k] / (mu[i] + mu[k]) / n;
            h[i] = 1.0 / (std::sqrt(1.0 - alpha) + 0.5 * alpha * integral);
        }
    }
    double flux = 0;
    for (size_t i = 0; i < n; ++i) flux += 2.0 * h[i] * mu[i] / n;
    return 1.0 - std::sqrt(1.0 - alpha) * flux;
}

void add_dome(TestScene& test) {
    test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
}

}  // namespace

// What comes back is what the theory of half spaces says of the medium, which is what was asked for
TEST(Subsurface, HalfSpaceHasItsAlbedo) {
    const Rgb color(0.2f, 0.5f, 0.8f);
    const Rgb alpha = shading::single_scattering_albedo(color, 0.0f);
    for (const float g : {0.0f, 0.6f, -0.4f}) {
        TestScene test;
        test.add_box(Vec3(-300, -300, -301), Vec3(300, 300, -1),
                     test.add_material(wax(color, Rgb(1.0f, 0.7f, 1.5f), g)));
        add_dome(test);
        test.look_at_point(1e-3);
        const RenderedLayers layers = render(test, {.size = 32, .samples = 512});
        for (int c = 0; c < 3; ++c) {
            const Estimate seen = layers.beauty(c);
            const double exact = exact_albedo(double(alpha[c]));
            fmt::print(
                "half space, g {}: {:.4f} +- {:.4f}, exact for even scattering {:.4f}, asked for "
                "{:.1f}\n",
                g, seen.mean, seen.standard_error, exact, double(color[c]));
            EXPECT_NEAR(exact, double(color[c]), 3e-3);
            if (g == 0.0f) {
                EXPECT_NEAR(seen.mean, exact, 4.0 * seen.standard_error);
                EXPECT_LE(5.3 * seen.standard_error, 5e-3);
            }
            // Similarity holds within this much
            EXPECT_NEAR(seen.mean, double(color[c]), 2.5e-2);
        }
    }
}

TEST(Subsurface, WhiteFurnaceIsOne) {
    // White all over, with and without what the interface reflects; paths that go in and do not
    for (const bool has_specular : {false, true}) {
        for (const float weight : {1.0f, 0.4f}) {
            TestScene test;
            scene::Material m = wax(Rgb(1.0f), Rgb(0.3f, 0.2f, 0.5f), 0.3f);
            m.has_specular = has_specular;
            m.roughness = scene::Input(0.4f);
            m.subsurface = scene::Input(weight);
            test.add_faceted_ball(1.0f, test.add_material(m));
            Mat4d placed;
            placed.setScale(Vec3d(1.3, 0.8, 1.0));
            test.make_instance(Mat4(placed * at(Vec3d(0.1, 0.0, -4.0))));
            add_dome(test);
            test.look_with_perspective(0.1);
            const RenderedLayers layers = render(test, {.size = 32, .samples = 512});
            for (int c = 0; c < 3; ++c)
                expect_close(layers.beauty(c), 1.0, 5e-3,
                             fmt::format("white wax, specular {}, weight {}, channel {}",
                                         has_specular, weight, c));
            EXPECT_GT(layers.rays.effects.of(scene::Effect::Subsurface), 0u);
        }
    }
}

// A medium so dense that light comes out where it went in is a matt surface
TEST(Subsurface, DenseMediaAreMatt) {
    double mean[2] = {0, 0}, error = 0;
    for (const bool is_matt : {false, true}) {
        TestScene test;
        scene::Material m = wax(Rgb(0.8f, 0.5f, 0.2f), Rgb(1e-4f));
        if (is_matt) m.subsurface = scene::Input(0.0f);
        test.add_box(Vec3(-1, -1, -3), Vec3(1, 1, -2), test.add_material(m));
        test.add_light(scene::LightKind::Sphere, at(Vec3d(0.4, 0.3, -0.5))).radius = 0.3f;
        test.look_at_point(0.5);
        const Estimate seen = render(test, {.size = 32, .samples = 256}).beauty(0);
        mean[is_matt] = seen.mean;
        if (!is_matt) error = seen.standard_error;
    }
    fmt::print("dense medium {:.5f}, matt {:.5f}\n", mean[0], mean[1]);
    EXPECT_NEAR(mean[0] / mean[1], 1.0, 1e-2);
    EXPECT_GT(error, 0.0);
}

// Light that went below is one scattering, of the light that it came from, by either sampler
TEST(Subsurface, IsOneBounceBySamplersThatAgree) {
    TestScene test;
    test.add_faceted_ball(1.0f,
                          test.add_material(wax(Rgb(0.9f, 0.6f, 0.3f), Rgb(0.4f, 0.2f, 0.1f))));
    test.make_instance(Mat4(at(Vec3d(0.0, 0.0, -4.0))));
    test.add_light(scene::LightKind::Sphere, at(Vec3d(1.5, 1.5, -2.0))).radius = 0.8f;
    test.look_with_perspective(0.2);
    TestRenderOptions options{.size = 32, .samples = 256};
    const RenderedLayers mis = render(test, options);
    EXPECT_NEAR(mis.bounce(1).mean / mis.beauty().mean, 1.0, 1e-6)
        << "a ball lights itself through its inside alone";
    options.seed = 2;
    for (const LightSampling sampler : {LightSampling::Light, LightSampling::Bsdf}) {
        options.estimator.light_sampling = sampler;
        expect_agreement(render(test, options), mis, 0.08,
                         fmt::format("wax by sampler {}", int(sampler)));
    }
}

// What is in the body, but of another mesh, is not in the way
TEST(Subsurface, WalksMeetTheirOwnMeshAlone) {
    double mean[2] = {0, 0}, error = 0;
    for (const bool has_core : {false, true}) {
        TestScene test;
        test.add_faceted_ball(1.0f, test.add_material(wax(Rgb(0.8f), Rgb(0.5f))));
        test.make_instance(Mat4(at(Vec3d(0.0, 0.0, -4.0))));
        if (has_core) test.add_sphere(Vec3(0, 0, -4), 0.8, test.add_matte(Rgb(0.0f)));
        add_dome(test);
        test.look_with_perspective(0.1);
        const Estimate seen = render(test, {.size = 16, .samples = 256}).beauty();
        mean[has_core] = seen.mean;
        error = std::hypot(error, seen.standard_error);
    }
    EXPECT_NEAR(mean[0], mean[1], 4.0 * error + 1e-6);
}

}  // namespace velatura::test
