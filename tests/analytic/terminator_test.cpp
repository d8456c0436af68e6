// SPDX-License-Identifier: Apache-2.0
// Shadow terminator: facets with interpolated normals against the sphere that they stand for (H15).
#include "geometry/surface_point.h"
#include "hard_case.h"
#include "integrator/world.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::test {

namespace {

const Vec3 center(0, 0, -4);

/// Latitude-longitude ball of radius 1 with the sphere's normals at its vertices.
void add_smooth_ball(TestScene& test, int rings, int segments, scene::MaterialId material) {
    scene::Mesh mesh;
    scene::Primvar normals;
    const auto add = [&](double theta, double phi) {
        const Vec3 n(float(std::sin(theta) * std::cos(phi)), float(std::cos(theta)),
                     float(std::sin(theta) * std::sin(phi)));
        mesh.points.push_back(center + n);
        mesh.normals.push_back(n);
    };
    for (int i = 0; i <= rings; ++i) {
        for (int j = 0; j < segments; ++j) {
            // One point at each pole, so that all triangles have three corners
            const bool is_pole = i == 0 || i == rings;
            add(pi_d * i / rings, is_pole ? 0.0 : 2 * pi_d * j / segments);
        }
    }
    const auto vertex = [&](int i, int j) {
        return uint32_t(i * segments + (i == 0 || i == rings ? 0 : j % segments));
    };
    for (int i = 0; i < rings; ++i) {
        for (int j = 0; j < segments; ++j) {
            for (const uint32_t v :
                 {vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)}) {
                mesh.face_vertex_indices.push_back(v);
            }
            mesh.face_vertex_counts.push_back(4);
        }
    }
    mesh.normal_interpolation = scene::Interpolation::Vertex;
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    test.scene.shapes.push_back(shape);
}

struct Errors {
    double worst = 0;
    double mean = 0;  // irradiance over the ball, light of irradiance 1 from one direction
    double true_mean = 0;
    size_t lifted = 0, points = 0;
};

/// Compares direct light from far away at points all over the ball with max(0, n·l) of the sphere.
Errors compare(const integrator::World& world, const Vec3& l, bool is_lifted) {
    Errors e;
    double area_sum = 0;
    const geometry::TriangleMesh& mesh = world.geometry.shapes()[0];
    constexpr int steps = 8;
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
        const Vec3d e1(mesh.corner(t, 1) - mesh.corner(t, 0));
        const Vec3d e2(mesh.corner(t, 2) - mesh.corner(t, 0));
        const double area = e1.cross(e2).length();
        for (int i = 0; i < steps; ++i) {
            for (int j = 0; i + j < steps; ++j) {
                geometry::Hit hit;
                hit.shape = 0;
                hit.triangle = t;
                hit.b1 = (float(i) + 0.3f) / float(steps);
                hit.b2 = (float(j) + 0.3f) / float(steps);
                geometry::SurfacePoint point =
                    make_surface_point(world.scene, world.geometry, geometry::Ray(), hit);
                const Vec3 wo = point.ng;
                const Vec3 truth = normalize(point.p - center);
                if (is_lifted) point = geometry::lifted(world.geometry, point, wo).value_or(point);
                e.lifted += point.side != 0 ? 1 : 0;
                ++e.points;
                const shading::Bsdf bsdf = world.materials.make_bsdf(point, wo, 0);
                double E = double(bsdf.f(wo, l).x) * pi_d * double(bsdf.cosine(l));
                if (world.accelerator->is_occluded(spawn_ray(point, l))) E = 0;
                const double exact = std::max(0.0, double(truth.dot(l)));
                e.worst = hardcase::larger(e.worst, std::abs(E - exact));
                e.mean += E * area;
                e.true_mean += exact * area;
                area_sum += area;
            }
        }
    }
    e.mean /= area_sum;
    e.true_mean /= area_sum;
    return e;
}

}  // namespace

TEST(H15Terminator, LiftedPointsSeeTheSphereThatFacetsStandFor) {
    TestScene test;
    add_smooth_ball(test, 8, 16, test.add_matte(Rgb(1.0f)));
    Diagnostics diagnostics;
    const integrator::World world(test.scene, {.width = 8, .height = 8}, {}, diagnostics);
    // Not along the mesh's planes of symmetry, where the terminator runs along edges
    for (const Vec3& l : {normalize(Vec3(1, 2, 0.5f)), normalize(Vec3(-2, 0.3f, 1)),
                          normalize(Vec3(0.3f, -0.2f, -1))}) {
        const Errors plain = compare(world, l, false), lifted = compare(world, l, true);
        fmt::print(
            "light from ({:.2f} {:.2f} {:.2f}): worst error {:.4f} -> {:.4f}, mean {:.4f} -> "
            "{:.4f}, sphere {:.4f}\n",
            l.x, l.y, l.z, plain.worst, lifted.worst, plain.mean, lifted.mean, lifted.true_mean);
        EXPECT_EQ(plain.lifted, 0u);
        EXPECT_EQ(lifted.lifted, lifted.points);
        EXPECT_GT(plain.worst, 0.1);
        const std::string from = fmt::format("light from ({:.1f} {:.1f} {:.1f})", l.x, l.y, l.z);
        hardcase::expect_within({from + ": worst error over that of plain facets",
                                 lifted.worst / plain.worst, 0.25, 0, "the sphere"});
        hardcase::expect_within({from + ": mean irradiance over that of plain facets, less 1",
                                 std::abs(lifted.mean / plain.mean - 1), 0.02, 0, "plain facets"});
        EXPECT_NEAR(lifted.mean / lifted.true_mean, 1.0, 0.02);
    }
}

TEST(H15Terminator, FineBallsAreLeftAlone) {
    TestScene test;
    add_smooth_ball(test, 181, 362, test.add_matte(Rgb(1.0f)));
    const geometry::GeometrySet geometry(test.scene);
    const auto triangle_count = uint32_t(geometry.shapes()[0].triangle_count());
    ASSERT_GT(triangle_count, 100000u);
    for (uint32_t t = 0; t < triangle_count; ++t) {
        const geometry::Hit hit{1.0f, 0.3f, 0.3f, scene::none, 0, t};
        const auto point = make_surface_point(test.scene, geometry, geometry::Ray(), hit);
        ASSERT_FALSE(lifted(geometry, point, point.ng));
    }
}

namespace {

TestScene ball_under(scene::LightKind kind, const scene::Material& material) {
    TestScene test;
    add_smooth_ball(test, 8, 16, test.add_material(material));
    Mat4d place;
    if (kind != scene::LightKind::Dome) place.setTranslation(Vec3d(0.6, 2.2, -3.5));
    scene::Light& light = test.add_light(kind, place);
    light.is_camera_visible = kind == scene::LightKind::Dome;
    if (kind == scene::LightKind::Sphere) light.radius = 1.0f;
    test.look_with_perspective(0.2);
    return test;
}

scene::Material plastic(float roughness) {
    scene::Material m;
    m.diffuse_color = scene::Input(Rgb(1.0f));
    m.roughness = scene::Input(roughness);
    return m;
}

}  // namespace

// White in a white dome: lifting may only bring back what facets took, never more
TEST(H15Terminator, FurnaceGainsNothing) {
    for (const float roughness : {0.0f, 0.4f, 1.0f}) {
        const Estimate e = render(ball_under(scene::LightKind::Dome, plastic(roughness)),
                                  {.size = 32, .samples = 256})
                               .beauty();
        fmt::print("coarse ball, roughness {}: {:.5f} +- {:.5f}\n", roughness, e.mean,
                   e.standard_error);
        hardcase::expect_within(
            {fmt::format(
                 "coarse ball, roughness {}: what a furnace exceeds 1 by, less 4 standard errors",
                 roughness),
             hardcase::larger(0.0, e.mean - 1.0 - 4 * e.standard_error), 1e-3, 0, "closed form",
             fmt::format("{:.1e}", e.detectable())});
        EXPECT_GE(e.mean, 0.97);
        EXPECT_LE(e.detectable(), 1e-2);
    }
}

// Lifted points do not reach through what touches the ball
TEST(ShadowTerminator, NoLightComesThroughAFloorThatTheBallRestsOn) {
    TestScene test;
    add_smooth_ball(test, 8, 16, test.add_matte(Rgb(1.0f)));
    constexpr float floor_y = -0.8f;
    scene::Mesh floor;
    floor.points = {{-9, floor_y, -9}, {9, floor_y, -9}, {9, floor_y, 9}, {-9, floor_y, 9}};
    floor.face_vertex_counts = {4};
    floor.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = floor;
    shape.material = test.add_matte(Rgb(0.0f));
    test.scene.shapes.push_back(shape);
    Mat4d place;
    place.setTranslation(Vec3d(0, -3, -4));
    test.add_light(scene::LightKind::Sphere, place).radius = 1.5f;
    test.look_with_perspective(0.3);
    // Facets in view do reach through the floor when they are lifted
    const geometry::GeometrySet geometry(test.scene);
    int through = 0;
    for (uint32_t t = 0; t < geometry.shapes()[0].triangle_count(); ++t) {
        for (const float b : {0.1f, 0.2f, 0.3f, 0.4f, 0.5f}) {
            const geometry::Hit hit{1.0f, b, b, scene::none, 0, t};
            const auto point = make_surface_point(test.scene, geometry, geometry::Ray(), hit);
            const auto start = lifted(geometry, point, -point.p).value_or(point);
            if (point.ng.dot(point.p) > 0.0f) continue;
            through += point.p.y > floor_y && start.p.y < floor_y ? 1 : 0;
        }
    }
    EXPECT_GT(through, 10);
    EXPECT_EQ(render(test, {.size = 64, .samples = 64}).beauty().mean, 0.0);
}

// f, its sampling and the origins of rays agree: either sampler alone gives the same light
TEST(ShadowTerminator, LightAndBsdfSamplingAgree) {
    const TestScene test = ball_under(scene::LightKind::Sphere, plastic(0.5f));
    TestRenderOptions options{.size = 32, .samples = 1024};
    Estimate by[3];
    for (int i = 0; i < 3; ++i) {
        options.estimator.light_sampling =
            std::array{integrator::LightSampling::Mis, integrator::LightSampling::Light,
                       integrator::LightSampling::Bsdf}[size_t(i)];
        by[i] = render(test, options).beauty();
    }
    for (int i = 1; i < 3; ++i) {
        // Pixels differ, and are the same in both: their spread is not the error of the mean
        EXPECT_NEAR(by[i].mean / by[0].mean, 1.0, 4e-3) << i;
    }
    fmt::print("means {:.5f} {:.5f} {:.5f}\n", by[0].mean, by[1].mean, by[2].mean);
}

}  // namespace velatura::test
