// SPDX-License-Identifier: Apache-2.0
#include "camera/camera_model.h"

#include "hard_case.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::camera {
namespace {

/// USD's fallback camera for a 3:2 image with a shifted window.
scene::Camera shifted_camera() {
    scene::Camera c;
    c.window_left = -0.2;
    c.window_right = 0.25;
    c.window_bottom = -0.1;
    c.window_top = 0.2;
    c.clip_far = 0;
    return c;
}

/// A rotation without zeros: columns of a unit quaternion's matrix.
Mat4d rotation() {
    const double w = 0.5, x = 0.5, y = -0.1, z = std::sqrt(1 - 0.51);
    return Mat4d(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
                 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
                 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, 0, 0, 0, 1);
}

void expect_near(const Vec3& a, const Vec3d& b, double bound) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(double(a[i]), b[i], bound);
}

TEST(CameraModel, PinholeRaysGoThroughTheWindow) {
    const CameraModel camera(shifted_camera(), 300, 200);

    struct Case {
        Vec2 film;
        Vec3d through;  // on the window at depth 1
    };

    const Case cases[] = {{{0, 0}, {-0.2, 0.2, -1}},
                          {{300, 200}, {0.25, -0.1, -1}},
                          {{150, 100}, {0.025, 0.05, -1}},
                          {{0.5f, 199.5f}, {-0.2 + 0.00075, -0.1 + 0.00075, -1}}};
    for (const Case& c : cases) {
        const CameraRay ray = camera.generate_ray(c.film, {0.3f, 0.7f});
        expect_near(ray.d, c.through / c.through.length(), 1e-7);
        EXPECT_EQ(ray.o, Vec3(0.0f));
        EXPECT_TRUE(std::isinf(ray.t_max));
    }
    EXPECT_FALSE(camera.has_lens());
    EXPECT_EQ(camera.depth(Vec3(1, 2, -3)), 3.0f);
}

TEST(H48Camera, DirectionsAreUnitFromNarrowToWide) {
    double worst = 0;
    for (const double degrees : {1e-3, 1.0, 45.0, 120.0, 179.9}) {
        scene::Camera c;
        const double half = std::tan(degrees * pi_d / 360);
        c.window_left = c.window_bottom = -half;
        c.window_right = c.window_top = half;
        c.render_from_camera = rotation();
        const CameraModel camera(c, 64, 64);
        for (int y = 0; y <= 64; y += 4) {
            for (int x = 0; x <= 64; x += 4) {
                const CameraRay ray = camera.generate_ray({float(x), float(y)}, {0, 0});
                worst = hardcase::larger(worst, std::abs(Vec3d(ray.d).length() - 1));
                EXPECT_TRUE(is_finite(ray.d) && ray.cone_spread > 0.0f);
            }
        }
    }
    hardcase::expect_within({"length of a direction, fields of 1e-3 to 179.9 degrees, less 1",
                             worst, 1e-6, 0, "length in double"});
}

TEST(CameraModel, ClippingPlanesArePlanes) {
    scene::Camera c = shifted_camera();
    c.clip_near = 2;
    c.clip_far = 50;
    c.render_from_camera = rotation();
    const CameraModel camera(c, 300, 200);
    const Vec3d axis = transform_direction(Vec3d(0, 0, -1), rotation());
    for (const Vec2& film : {Vec2(0, 0), Vec2(300, 10), Vec2(150, 100)}) {
        const CameraRay ray = camera.generate_ray(film, {0, 0});
        EXPECT_NEAR(Vec3d(ray.o).dot(axis), 2, 2e-6);
        EXPECT_NEAR((Vec3d(ray.o) + Vec3d(ray.d) * double(ray.t_max)).dot(axis), 50, 2e-5);
    }
}

TEST(CameraModel, LensRaysMeetInThePlaneOfFocus) {
    scene::Camera c = shifted_camera();
    c.lens_radius = 0.3;
    c.focus_distance = 7;
    c.render_from_camera = rotation();
    const CameraModel camera(c, 300, 200);
    scene::Camera pinhole_camera = c;
    pinhole_camera.lens_radius = 0;
    const CameraModel pinhole(pinhole_camera, 300, 200);
    const Vec3d axis = normalize(transform_direction(Vec3d(0.0, 0.0, -1.0), c.render_from_camera));
    ASSERT_TRUE(camera.has_lens());
    for (const Vec2& film : {Vec2(0, 0), Vec2(300, 10), Vec2(150, 100)}) {
        const Vec3d center(pinhole.generate_ray(film, {0, 0}).d);
        const Vec3d focus = center * (7 / center.dot(axis));
        double mean_squared_radius = 0;
        for (int i = 0; i < 16; ++i) {
            for (int j = 0; j < 16; ++j) {
                const Vec2 u((float(i) + 0.5f) / 16.0f, (float(j) + 0.5f) / 16.0f);
                const CameraRay ray = camera.generate_ray(film, u);
                const Vec3d o(ray.o), d(ray.d);
                // The start lies on the lens, the ray goes through the focus point
                EXPECT_NEAR(o.dot(axis), 0, 1e-7);
                EXPECT_LE(o.length(), 0.3 * (1 + 1e-6));
                const double t = (7 - o.dot(axis)) / d.dot(axis);
                EXPECT_LE((o + d * t - focus).length(), 2e-6);
                mean_squared_radius += o.dot(o) / 256;
            }
        }
        // Uniform over the disk: mean of r² is R²/2
        EXPECT_NEAR(mean_squared_radius, 0.045, 0.0005);
    }
}

TEST(H48Camera, ApertureZeroAndFocusZeroArePinholesBitForBit) {
    scene::Camera pinhole = shifted_camera();
    pinhole.render_from_camera = rotation();
    pinhole.clip_near = 0.125;
    scene::Camera closed = pinhole;
    closed.focus_distance = 3;
    scene::Camera unfocused = pinhole;
    unfocused.lens_radius = 1;
    const CameraModel a(pinhole, 30, 20), b(closed, 30, 20), c(unfocused, 30, 20);
    size_t different = 0;
    for (int i = 0; i < 600; ++i) {
        const Vec2 film(float(i % 30) + 0.3f, float(i / 30) + 0.8f);
        const Vec2 u(float(i) / 600.0f, 0.25f);
        const CameraRay x = a.generate_ray(film, u);
        for (const CameraModel* other : {&b, &c}) {
            const CameraRay y = other->generate_ray(film, u);
            different += !(x.o == y.o && x.d == y.d && x.t_max == y.t_max);
        }
    }
    hardcase::expect_within({"rays of 1200 that are not the pinhole's, bit for bit",
                             double(different), 0, 0, "the pinhole"});
}

TEST(H48Camera, InfiniteFocusGivesParallelRays) {
    scene::Camera c = shifted_camera();
    c.lens_radius = 0.5;
    c.focus_distance = std::numeric_limits<double>::infinity();
    const CameraModel camera(c, 30, 20);
    const CameraRay a = camera.generate_ray({3, 4}, {0.1f, 0.9f});
    const CameraRay b = camera.generate_ray({3, 4}, {0.8f, 0.2f});
    hardcase::expect_within({"angle between two rays of one pixel, focus at infinity",
                             double((a.d - b.d).length()), 0, 0, "parallel"});
    EXPECT_NE(a.o, b.o);
    EXPECT_TRUE(is_finite(a.o) && is_finite(a.d));
}

TEST(CameraModel, OrthographicRaysAreParallelAndStartOnTheWindow) {
    scene::Camera c;
    c.projection = scene::Camera::Projection::Orthographic;
    c.window_left = -3;
    c.window_right = 1;
    c.window_bottom = -1;
    c.window_top = 1;
    c.clip_near = 1;
    c.clip_far = 11;
    const CameraModel camera(c, 40, 20);
    const CameraRay a = camera.generate_ray({0, 0}, {0, 0});
    const CameraRay b = camera.generate_ray({40, 20}, {0, 0});
    EXPECT_EQ(a.o, Vec3(-3, 1, -1));
    EXPECT_EQ(b.o, Vec3(1, -1, -1));
    EXPECT_EQ(a.d, Vec3(0, 0, -1));
    EXPECT_EQ(b.d, Vec3(0, 0, -1));
    EXPECT_EQ(a.t_max, 10.0f);
    EXPECT_EQ(a.cone_spread, 0.0f);
    EXPECT_NEAR(a.cone_width, 0.1f, 1e-7f);
}

TEST(CameraModel, ScalingByPowersOfTwoScalesOriginsAndKeepsDirections) {
    scene::Camera c = shifted_camera();
    c.render_from_camera = rotation();
    c.lens_radius = 0.01;
    c.focus_distance = 5;
    c.clip_near = 0.1;
    c.clip_far = 1e6;
    const CameraModel camera(c, 300, 200);
    for (const int k : {-40, -20, 1, 20, 40}) {
        const double factor = std::ldexp(1.0, k);
        // Scaled by its numbers, and by its transform
        scene::Camera by_numbers = c, by_transform = c;
        for (double* v : {&by_numbers.lens_radius, &by_numbers.focus_distance,
                          &by_numbers.clip_near, &by_numbers.clip_far})
            *v *= factor;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                by_transform.render_from_camera[row][column] *= factor;
        for (const scene::Camera& scaled : {by_numbers, by_transform}) {
            const CameraModel other(scaled, 300, 200);
            for (int i = 0; i < 100; ++i) {
                const Vec2 film(float(3 * i) + 0.4f, float(2 * i) + 0.1f),
                    u(float(i) / 100.0f, 0.7f);
                const CameraRay a = camera.generate_ray(film, u), b = other.generate_ray(film, u);
                EXPECT_EQ(a.d, b.d);
                EXPECT_EQ(a.o * float(factor), b.o);
                EXPECT_EQ(a.t_max * float(factor), b.t_max);
                EXPECT_EQ(a.cone_spread, b.cone_spread);
                EXPECT_EQ(a.cone_width * float(factor), b.cone_width);
            }
        }
    }
}

TEST(CameraModel, ConeCoversOnePixel) {
    const CameraModel camera(shifted_camera(), 300, 200);
    // Distance between the rays of neighboring pixels at depth 10 near the axis
    const CameraRay a = camera.generate_ray({133, 133}, {0, 0});
    const CameraRay b = camera.generate_ray({134, 133}, {0, 0});
    const float ta = -10.0f / a.d.z, tb = -10.0f / b.d.z;
    EXPECT_NEAR(((a.o + a.d * ta) - (b.o + b.d * tb)).length(), a.cone_width + a.cone_spread * ta,
                2e-5f);
}

TEST(CameraModel, MatricesFollowOpenExr) {
    for (const auto projection :
         {scene::Camera::Projection::Perspective, scene::Camera::Projection::Orthographic}) {
        scene::Camera c = shifted_camera();
        c.projection = projection;
        c.render_from_camera = rotation();
        c.world_position = {1000, -2000, 500};
        c.clip_near = 1;
        c.clip_far = 100;
        const CameraModel camera(c, 300, 200);
        for (const Vec2& film : {Vec2(0, 0), Vec2(300, 200), Vec2(75, 150)}) {
            const CameraRay ray = camera.generate_ray(film, {0, 0});
            for (const double t : {0.0, double(ray.t_max)}) {
                const Vec3d world = Vec3d(ray.o) + Vec3d(ray.d) * t + c.world_position;
                Vec3d ndc, in_camera;
                camera.world_to_ndc().multVecMatrix(world, ndc);  // divides by w
                EXPECT_NEAR(ndc.x, double(film.x) / 300, 2e-5);
                EXPECT_NEAR(ndc.y, double(film.y) / 200, 2e-5);
                EXPECT_NEAR(ndc.z, t == 0.0 ? 0 : 1, 1e-5);
                camera.world_to_camera().multVecMatrix(world, in_camera);
                EXPECT_NEAR(in_camera.z, t == 0.0 ? 1 : 100, 1e-4);  // left-handed: z is depth
            }
        }
        // x right and y up: the upper left corner
        const CameraRay corner = camera.generate_ray({0, 0}, {0, 0});
        Vec3d in_camera;
        camera.world_to_camera().multVecMatrix(Vec3d(corner.o) + c.world_position, in_camera);
        EXPECT_NEAR(in_camera.x, -0.2, 1e-5);
        EXPECT_NEAR(in_camera.y, 0.2, 1e-5);
    }
}

/// At a key, and at any time of a camera that is the same at all, it is the still camera there, bit
/// for bit.
TEST(CameraModel, MovesFromKeyToKey) {
    scene::Camera moving = shifted_camera(), there = shifted_camera();
    moving.lens_radius = there.lens_radius = 0.1;
    moving.focus_distance = there.focus_distance = 4;
    moving.clip_near = there.clip_near = 0.5;
    Mat4d first = rotation(), second = rotation(), third = rotation();
    second[3][0] = 3;
    third[3][0] = 5;
    third[3][1] = -2;
    moving.render_from_camera = second;
    moving.motion_keys = {first, second, third};
    const CameraModel camera(moving, 300, 200);
    EXPECT_TRUE(camera.has_motion());
    const auto expect_same = [&](float time, const Mat4d& matrix) {
        there.render_from_camera = matrix;
        const CameraModel still(there, 300, 200);
        EXPECT_FALSE(still.has_motion());
        for (const Vec2& film : {Vec2(0, 0), Vec2(210, 20)}) {
            const CameraRay a = camera.generate_ray(film, {0.2f, 0.6f}, time);
            const CameraRay b = still.generate_ray(film, {0.2f, 0.6f}, 0.3f);
            EXPECT_EQ(a.o, b.o) << time;
            EXPECT_EQ(a.d, b.d) << time;
            EXPECT_EQ(a.t_max, b.t_max);
        }
    };
    expect_same(0.0f, first);
    expect_same(0.5f, second);
    expect_same(1.0f, third);
    expect_same(0.25f, (first + second) * 0.5);
    expect_same(-1.0f, first);
    expect_same(2.0f, third);
    moving.motion_keys = {second, second};
    const CameraRay a = CameraModel(moving, 300, 200).generate_ray({9, 9}, {0, 0}, 0.37f);
    there.render_from_camera = second;
    EXPECT_EQ(a.o, CameraModel(there, 300, 200).generate_ray({9, 9}, {0, 0}).o);
}

/// What connect() finds for a point of a ray is that ray's film point, through lenses, windows
/// aside and motion; and its factor is the area on the film that a small square across the ray
/// covers.
TEST(CameraModel, ConnectionsAreTheInverseOfRays) {
    scene::Camera plain = shifted_camera(), lens = shifted_camera(), flat = shifted_camera(),
                  moving = shifted_camera();
    for (scene::Camera* c : {&plain, &lens, &flat, &moving})
        c->render_from_camera = rotation() * Mat4d(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, -2, 5, 1);
    lens.lens_radius = 0.2;
    lens.focus_distance = 4;
    lens.clip_near = 0.5;
    flat.projection = scene::Camera::Projection::Orthographic;
    flat.lens_radius = 0.1;
    flat.focus_distance = 3;
    moving.motion_keys = {moving.render_from_camera, plain.render_from_camera};
    moving.motion_keys[1][3][0] += 2.0;
    for (const scene::Camera& settings : {plain, lens, flat, moving}) {
        const CameraModel camera(settings, 300, 200);
        for (const Vec2& film : {Vec2(12.3f, 170.6f), Vec2(150.0f, 100.0f), Vec2(280.25f, 3.5f)}) {
            for (const Vec2& u : {Vec2(0.5f), Vec2(0.1f, 0.8f)}) {
                const float time = 0.3f;
                const CameraRay ray = camera.generate_ray(film, u, time);
                const Vec3 p = ray.o + ray.d * 6.0f;
                const auto found = camera.connect(p, u, time);
                ASSERT_TRUE(found.has_value());
                EXPECT_NEAR(found->film_point.x, film.x, 2e-3f);
                EXPECT_NEAR(found->film_point.y, film.y, 2e-3f);
                EXPECT_NEAR(found->distance, 6.0f, 1e-4f);
                expect_near(found->o, Vec3d(ray.o), 1e-5);
                expect_near(found->wi, -Vec3d(ray.d), 1e-6);

                // Area on the film of a square across the ray, by central differences
                const Frame frame = Frame::from_z(ray.d);
                constexpr float h = 0.02f;
                const auto at = [&](const Vec3& offset) {
                    return Vec2d(camera.connect(p + offset, u, time)->film_point);
                };
                const Vec2d dx = (at(frame.x * h) - at(frame.x * -h)) / (2.0 * double(h)),
                            dy = (at(frame.y * h) - at(frame.y * -h)) / (2.0 * double(h));
                const double area = std::abs(dx.x * dy.y - dx.y * dy.x);
                EXPECT_NEAR(double(found->film_per_area), area, 2e-3 * area);
            }
        }
        const CameraRay middle = camera.generate_ray({150, 100}, Vec2(0.5f), 0.3f);
        EXPECT_FALSE(camera.connect(middle.o - middle.d * 2.0f, Vec2(0.5f), 0.3f).has_value())
            << "behind the near plane";
    }
}

}  // namespace
}  // namespace velatura::camera
