// SPDX-License-Identifier: Apache-2.0
// Irradiance of a matte patch behind glass and by mirrors: what --caustics manifold finds, against
// integrals that know nothing of it.
#include "render/renderer.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace velatura::test {

namespace {

constexpr double patch_z = -1.0;
constexpr double slab_bottom = 0.25, slab_top = 0.75;  ///< above the camera, out of its sight
constexpr double ior = 1.5;

TestScene patch_scene() {
    TestScene test;
    test.add_square(float(patch_z), 0.01f, test.add_matte(Rgb(1.0f)));
    return test;
}

void add_slab(TestScene& test, float half_size) {
    const scene::MaterialId glass = test.add_material(smooth_glass(float(ior)));
    test.add_square(float(slab_top), half_size, glass);
    test.add_square(float(slab_bottom), half_size, glass);
    test.scene.shapes.back().flip_normals = true;
}

/// UsdPreviewSurface's Fresnel term of a dielectric, by the cosine outside.
double reflectance(double cosine) {
    const double f0 = std::pow((ior - 1.0) / (ior + 1.0), 2);
    return f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5);
}

/// Irradiance of the patch through the slab, of radiance 1 from where `is_light(o, d)` says that
/// the ray o + t·d meets light: midpoint rule over directions. They leave the slab as they enter
/// it, moved aside.
double slab_irradiance(double theta_0,
                       double theta_1,
                       double phi_0,
                       double phi_1,
                       const std::function<bool(const Vec3d&, const Vec3d&)>& is_light) {
    constexpr int steps = 1500;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double theta = theta_0 + (theta_1 - theta_0) * (i + 0.5) / steps;
        const double s = std::sin(theta), c = std::cos(theta);
        const double inside = std::sqrt(1.0 - s * s / (ior * ior));
        const double aside =
            (slab_bottom - patch_z) * s / c + (slab_top - slab_bottom) * (s / ior) / inside;
        const double passed = std::pow(1.0 - reflectance(c), 2);
        for (int k = 0; k < steps; ++k) {
            const double phi = phi_0 + (phi_1 - phi_0) * (k + 0.5) / steps;
            const Vec3d across(std::cos(phi), std::sin(phi), 0.0);
            if (is_light(across * aside + Vec3d(0, 0, slab_top), across * s + Vec3d(0, 0, c)))
                sum += passed * c * s;
        }
    }
    return sum * (theta_1 - theta_0) * (phi_1 - phi_0) / (double(steps) * steps);
}

bool meets_sphere(const Vec3d& o, const Vec3d& d, const Vec3d& center, double radius) {
    const Vec3d w = center - o;
    const double along = w.dot(d);
    return along > 0.0 && w.dot(w) - along * along < radius * radius;
}

/// Irradiance in a bounce column against what is expected.
void expect_irradiance(const TestScene& test,
                       int bounce,
                       double expected,
                       double relative,
                       const std::string& what,
                       uint64_t samples = 1024) {
    const RenderedLayers layers = render(test, {.size = 16,
                                                .samples = samples,
                                                .last_bounce = 6,
                                                .caustics = integrator::Caustics::Manifold});
    Estimate e = layers.bounce(bounce, 0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, expected, relative, what);
    EXPECT_GT(layers.rays.caustics_found, 0u);
}

}  // namespace

TEST(Caustics, SmallSphereStraightAboveASlab) {
    TestScene test = patch_scene();
    add_slab(test, 0.9f);
    const Vec3d center(0, 0, 2);
    test.add_light(scene::LightKind::Sphere, at(center)).radius = 0.01f;
    const double r = double(0.01f);
    const double expected = slab_irradiance(
        0, 0.01, 0, 2 * pi_d,
        [&](const Vec3d& o, const Vec3d& d) { return meets_sphere(o, d, center, r); });
    expect_irradiance(test, 3, expected, 4e-2, "sphere of radius 0.01 above a slab");
}

TEST(Caustics, SphereBesideASlab) {
    TestScene test = patch_scene();
    add_slab(test, 8.0f);
    const Vec3d center(2.5, 0, 2);
    test.add_light(scene::LightKind::Sphere, at(center)).radius = 0.1f;
    const double r = double(0.1f);
    const double expected = slab_irradiance(
        0.6, 0.8, -0.08, 0.08,
        [&](const Vec3d& o, const Vec3d& d) { return meets_sphere(o, d, center, r); });
    expect_irradiance(test, 3, expected, 4e-2, "sphere of radius 0.1 beside a slab");
}

TEST(Caustics, DiskAboveASlab) {
    TestScene test = patch_scene();
    add_slab(test, 4.0f);
    test.add_light(scene::LightKind::Disk, at(Vec3d(0, 0, 2))).radius = 0.05f;
    const double expected =
        slab_irradiance(0, 0.03, 0, 2 * pi_d, [](const Vec3d& o, const Vec3d& d) {
            const Vec3d p = o + d * ((2.0 - o.z) / d.z);
            return p.x * p.x + p.y * p.y < 0.0025;
        });
    expect_irradiance(test, 3, expected, 2e-2, "disk of radius 0.05 above a slab");
}

TEST(Caustics, ObliqueRectAboveASlab) {
    TestScene test = patch_scene();
    add_slab(test, 8.0f);
    Mat4d m;
    m.setAxisAngle(Vec3d(0, 1, 0), 0.5);
    m = m * at(Vec3d(0.5, 0.2, 2));
    scene::Light& light = test.add_light(scene::LightKind::Rect, m);
    light.width = 0.2f;
    light.height = 0.1f;
    const Vec3d x = transform_direction(Vec3d(1, 0, 0), m),
                y = transform_direction(Vec3d(0, 1, 0), m),
                n = transform_direction(Vec3d(0, 0, 1), m);
    const double expected =
        slab_irradiance(0.1, 0.27, 0.1, 0.65, [&](const Vec3d& o, const Vec3d& d) {
            const Vec3d center(0.5, 0.2, 2);
            const Vec3d p = o + d * ((center - o).dot(n) / d.dot(n)) - center;
            return std::abs(p.dot(x)) < 0.1 && std::abs(p.dot(y)) < 0.05;
        });
    expect_irradiance(test, 3, expected, 2e-2, "oblique rect above a slab");
}

TEST(Caustics, SunThroughASlab) {
    for (const double angle : {0.53, 8.0}) {
        TestScene test = patch_scene();
        add_slab(test, 8.0f);
        test.add_light(scene::LightKind::Distant, Mat4d()).angle_deg = float(angle);
        const double half = 0.5 * double(float(angle)) * pi_d / 180.0;
        const double expected =
            slab_irradiance(0, half, 0, 2 * pi_d, [](const Vec3d&, const Vec3d&) { return true; });
        expect_irradiance(test, 3, expected, 2e-2,
                          fmt::format("sun of {} degrees through a slab", angle));
    }
}

TEST(Caustics, SunWithoutExtentThroughASlab) {
    // No path can meet this one: light behind glass is missing without the technique
    TestScene test = patch_scene();
    add_slab(test, 8.0f);
    Mat4d m;
    m.setAxisAngle(Vec3d(0, 1, 0), 0.7);
    test.add_light(scene::LightKind::Distant, m).angle_deg = 0.0f;
    const double c = std::cos(0.7);
    expect_irradiance(test, 3, c * std::pow(1.0 - reflectance(c), 2), 2e-2,
                      "directional light through a slab");
    EXPECT_EQ(render(test, {.size = 16, .samples = 16, .last_bounce = 6}).bounce(3, 0).mean, 0.0);
}

TEST(Caustics, UnderWater) {
    // The patch inside, the light outside: one refraction, radiance grows by the square of the
    // index
    TestScene test = patch_scene();
    test.add_square(0.5f, 6.0f, test.add_material(smooth_glass(float(ior))));
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0, 0, 2))).radius = 0.05f;
    const double r = double(0.05f);
    double expected = 0;
    constexpr int steps = 20000;
    for (int i = 0; i < steps; ++i) {
        const double theta = 0.03 * (i + 0.5) / steps;
        const double s = std::sin(theta), out_s = ior * s, out_c = std::sqrt(1.0 - out_s * out_s);
        const Vec3d o(1.5 * s / std::cos(theta), 0, 0.5), d(out_s, 0, out_c);
        if (meets_sphere(o, d, Vec3d(0, 0, 2), r))
            expected += 2.0 * pi_d * s * std::cos(theta) * ior * ior * (1.0 - reflectance(out_c)) *
                        0.03 / steps;
    }
    expect_irradiance(test, 2, expected, 4e-2, "sphere seen from under water");
}

TEST(Caustics, FlatMirror) {
    TestScene test = patch_scene();
    test.add_square(2.0f, 20.0f, test.add_material(mirror(Rgb(0.9f))));
    test.scene.shapes.back().flip_normals = true;
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0, 0, 1))).radius = 0.05f;
    // The mirror image stands at z = 3
    const double r = double(0.05f);
    expect_irradiance(test, 2, double(0.9f) * pi_d * r * r / 16.0, 4e-2, "sphere in a mirror");
}

TEST(MirroredLamp, InGlassHasTheNoiseOfOneSampleInThree) {
    // A pane that reflects 4 % of a lamp of radiance 1 behind the camera, and lets the rest through
    // to nothing. By Fresnel's share one sample of 25 would bring 1, a deviation of 0.196; one of
    // three brings 0.12, a deviation of 0.04 √2
    TestScene test;
    test.add_square(-2.0f, 10.0f, test.add_material(smooth_glass(float(ior))));
    test.add_light(scene::LightKind::Rect,
                   Mat4d(100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1, 0, 0, 0, 2, 1));
    test.look_at_point(0.01);
    constexpr int size = 32, samples = 64;
    const Estimate seen = render(test, {.size = size,
                                        .samples = samples,
                                        .last_bounce = 1,
                                        .max_depth = 2,
                                        .estimator = {.roulette = integrator::Roulette::None},
                                        .sampler = sampling::SamplerKind::Independent})
                              .beauty();
    const double expected = reflectance(1.0);
    expect_close(seen, expected, 0.05, "a lamp in a pane of glass");
    const double deviation = seen.standard_error * std::sqrt(double(size * size * samples));
    EXPECT_NEAR(deviation, expected * std::sqrt(2.0), 0.1 * expected);
}

TEST(MirroredLamp, BehindASlabOfGlassIsLookedForFromTheInside) {
    // Reflected at the front, 1/25, or at the back, (24/25)²/25. By Fresnel's share the latter has
    // one path of 26, and a deviation of 0.23. One of three at each of both: 0.12 for 1/3 of all
    // paths, and of the 2/3 that enter (24/25 ÷ 2/3 = 1.44) 1.44 · 0.12 for 1/3, of which 24/25
    // leave
    TestScene test;
    const scene::MaterialId glass = test.add_material(smooth_glass(float(ior)));
    test.add_square(-2.0f, 10.0f, glass);
    test.add_square(-2.5f, 10.0f, glass);
    test.scene.shapes.back().flip_normals = true;
    test.add_light(scene::LightKind::Rect,
                   Mat4d(100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1, 0, 0, 0, 2, 1));
    test.look_at_point(0.01);
    constexpr int size = 32, samples = 64;
    const Estimate seen = render(test, {.size = size,
                                        .samples = samples,
                                        .last_bounce = 3,
                                        .max_depth = 3,
                                        .estimator = {.roulette = integrator::Roulette::None},
                                        .sampler = sampling::SamplerKind::Independent})
                              .beauty();
    const double r = reflectance(1.0), front = r, back = (1 - r) * (1 - r) * r;
    expect_close(seen, front + back, 0.05, "a lamp in a slab of glass");
    const double at_front = 3 * r, at_back = 1.5 * (1 - r) * 3 * r;
    const double second_moment = at_front * at_front / 3 + at_back * at_back * (1 - r) * 2 / 9;
    const double expected = std::sqrt(second_moment - (front + back) * (front + back));
    const double deviation = seen.standard_error * std::sqrt(double(size * size * samples));
    EXPECT_NEAR(deviation, expected, 0.1 * expected);
}

namespace {

/// What the trial before a render by light tracing says.
statistics::HiddenLight hidden_light(const TestScene& test) {
    render::Settings settings;
    settings.layers = render::with_rows(std::move(settings.layers), test.scene);
    settings.world = {.width = 256, .height = 256};
    settings.caustics = integrator::Caustics::Light;
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    Diagnostics diagnostics;
    render::Renderer renderer(test.scene, std::move(settings));
    renderer.prepare(diagnostics);
    if (!renderer.prepass().hidden) {
        ADD_FAILURE() << "no trial";
        return {};
    }
    return renderer.prepass().hidden->light;
}

}  // namespace

TEST(HiddenCaustics, HaveTheMomentsOfPathsThatFindALampByChance) {
    // A white floor seen through a slab, and lit through it by a lamp of radius 0.1 and radiance 1:
    // paths cross the slab, (24/25)², meet the lamp by chance, E / π, and bring 1 then. The image
    // is dark, so that its error weight is 100. The slab of 0.5 brings the lamp nearer by 1/6: 7 to
    // 6.833
    TestScene test;
    const scene::MaterialId glass = test.add_material(smooth_glass(float(ior)));
    test.add_square(-4.0f, 2.0f, test.add_matte(Rgb(1.0f)));
    test.add_square(-0.25f, 0.45f, glass);
    test.add_square(-0.75f, 0.45f, glass);
    test.scene.shapes.back().flip_normals = true;
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.6, 0, 3))).radius = 0.1f;
    test.look_at_point(0.01);
    const double across = 0.6 / (7.0 - 0.5 / 3), cosine = 1 / std::hypot(1.0, across);
    const double distance = (7.0 - 0.5 / 3) / cosine;
    const double passed = std::pow(1 - reflectance(cosine), 2);
    const double irradiance = pi_d * 0.01 / (distance * distance) * cosine * passed;
    const double probability = std::pow(1 - reflectance(1.0), 2) * irradiance / pi_d;
    const statistics::HiddenLight light = hidden_light(test);
    EXPECT_NEAR(light.square / (100 * probability), 1, 0.1);
    EXPECT_NEAR(light.fourth / (1e4 * probability), 1, 0.1);
}

TEST(HiddenCaustics, AreNoneWhereTheCameraSeesTheFloorItself) {
    TestScene test;
    test.add_square(-4.0f, 2.0f, test.add_matte(Rgb(1.0f)));
    add_slab(test, 0.45f);
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.6, 0, 3))).radius = 0.1f;
    test.look_at_point(0.01);
    EXPECT_EQ(hidden_light(test).square, 0);
}

}  // namespace velatura::test
