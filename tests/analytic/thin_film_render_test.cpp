// SPDX-License-Identifier: Apache-2.0
// Rendered thin films under a white dome: what they reflect is the reflectance of the film, summed
// over the wavelengths.
#include "shading/thin_film.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace velatura::test {

namespace {

/// Airy's formula by amplitudes, both polarizations, one wavelength after the other. Lengths in
/// micrometers.
double film_color(
    int channel, double cosine, double film, std::complex<double> below, double thickness) {
    using Complex = std::complex<double>;
    const double sine2 = 1.0 - cosine * cosine, inside = std::sqrt(1.0 - sine2 / (film * film));
    const Complex base = std::sqrt(below * below - sine2);  // index times cosine
    const Complex s2 = (film * inside - base) / (film * inside + base);
    const Complex p2 =
        (below * below * inside - film * base) / (below * below * inside + film * base);
    const double s1 = (cosine - film * inside) / (cosine + film * inside);
    const double p1 = (film * cosine - inside) / (film * cosine + inside);
    double sum = 0, nm = shading::film_observer::first_nm;
    for (const Vec3d& share : shading::film_observer::shares()) {
        const Complex turn = std::polar(1.0, 4e3 * pi_d * film * thickness * inside / nm);
        const double s = std::norm((s1 + s2 * turn) / (1.0 + s1 * s2 * turn));
        const double p = std::norm((p1 + p2 * turn) / (1.0 + p1 * p2 * turn));
        sum += share[channel] * 0.5 * (s + p);
        nm += 1;
    }
    return std::clamp(sum, 0.0, 1.0);
}

scene::Material filmed(float thickness, float ior) {
    scene::Material m;
    m.diffuse_color = scene::Input(Rgb(0.0f));
    m.roughness = scene::Input(0.0f);
    m.extras.emplace();
    scene::ThinFilmInputs& film = m.extras->film.emplace();
    film.thickness = scene::Input(thickness);
    film.ior = scene::Input(ior);
    return m;
}

/// A tilted wall that the camera sees one point of, under a dome of radiance 1.
RenderedLayers render_wall(const scene::Material& material, double tilt, uint64_t samples) {
    TestScene test;
    const float x = float(std::cos(tilt)), z = float(std::sin(tilt));
    scene::Mesh mesh;
    mesh.points = {{-x, -1, -3 - z}, {x, -1, -3 + z}, {x, 1, -3 + z}, {-x, 1, -3 - z}};
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = test.add_material(material);
    test.scene.shapes.push_back(shape);
    test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
    test.look_at_point(1e-3);
    return render(test, {.size = 8, .samples = samples});
}

/// Which of reflection and the rest a path follows is drawn.
void expect_mean(const Estimate& found, double expected, double bias, const std::string& what) {
    EXPECT_NEAR(found.mean, expected, bias + 5 * found.standard_error) << what;
    EXPECT_LT(5 * found.standard_error, 0.03) << what;
}

}  // namespace

TEST(RenderedThinFilm, OnGlassReflectsItsColor) {
    for (const double tilt : {0.0, 0.7, 1.2}) {
        const RenderedLayers layers = render_wall(filmed(0.3f, 1.9f), tilt, 256);
        for (int c = 0; c < 3; ++c)
            expect_mean(layers.bounce(1, 0, c), film_color(c, std::cos(tilt), 1.9f, 1.5, 0.3f),
                        1e-3, fmt::format("{} {}", tilt, c));
    }
}

TEST(RenderedThinFilm, OnMetalReflectsItsColor) {
    const Rgb f0(0.9f, 0.6f, 0.4f);
    scene::Material m = filmed(0.35f, 1.5f);
    m.metallic = scene::Input(1.0f);
    m.extras->metal_f0 = scene::Input(f0);
    m.extras->film->metal_tint = scene::Input(Rgb(0.5f, 1.0f, 1.0f));
    for (const double tilt : {0.0, 0.7, 1.2}) {
        const RenderedLayers layers = render_wall(m, tilt, 4);
        for (int c = 0; c < 3; ++c) {
            const shading::MetalIndex index =
                shading::metal_index(f0[c], f0[c] + (1.0f - f0[c]) * 0.46266438f);
            const double expected =
                film_color(c, std::cos(tilt), 1.5, {double(index.n), double(index.k)}, 0.35f);
            EXPECT_NEAR(layers.bounce(1, 0, c).mean, expected * (c == 0 ? 0.5 : 1.0), 2e-3)
                << tilt << " " << c;
        }
    }
}

// A soap bubble takes nothing: what it does not reflect goes through, in every color
TEST(RenderedThinFilm, BubbleKeepsAllLight) {
    scene::Material m = filmed(0.4f, 1.33f);
    m.ior = scene::Input(1.0f);
    m.opacity = scene::Input(0.0f);
    m.thin_walled = true;
    const RenderedLayers layers = render_wall(m, 0.7, 64);
    for (int c = 0; c < 3; ++c) expect_mean(layers.beauty(c), 1.0, 1e-3, fmt::format("{}", c));
    EXPECT_GT(std::abs(layers.bounce(1, 0, 0).mean - layers.bounce(1, 0, 2).mean), 0.005);
}

}  // namespace velatura::test
