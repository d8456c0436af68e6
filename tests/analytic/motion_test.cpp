// SPDX-License-Identifier: Apache-2.0
// Blur of what moves while the shutter is open, against its profile (docs/engineering/hard_cases.md
// H47).
#include "hard_case.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace velatura::test {

namespace {

constexpr int size = 64;

/// Radiance of a pixel.
double pixel(const RenderedLayers& layers, int x, int y) {
    const accumulate::PixelRecord& record = layers.film.sums().record(x, y);
    return layers.film.sums().total(x, y, accumulate::AccumulatorTable::beauty).x /
           double(record.end - record.first);
}

/// A black plate of these corners at z = −2, in front of a wall of radiance 1. Keys: its corners at
/// the later ones.
TestScene plate_before_wall(const std::vector<Vec3>& corners, std::vector<std::vector<Vec3>> keys) {
    TestScene test;
    test.look_at_point(1.0);
    test.add_square(-5.0f, 10.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    scene::Mesh plate;
    plate.points = corners;
    plate.later_points = std::move(keys);
    plate.face_vertex_counts = {uint32_t(corners.size())};
    for (uint32_t i = 0; i < corners.size(); ++i) plate.face_vertex_indices.push_back(i);
    scene::Shape shape;
    shape.geometry = plate;
    shape.material = test.add_matte(Rgb(0.0f));
    test.scene.shapes.push_back(shape);
    return test;
}

/// A plate from far on the left to an edge at x.
std::vector<Vec3> half_plane(float x) {
    return {{-9, -9, -2}, {x, -9, -2}, {x, 9, -2}, {-9, 9, -2}};
}

/// Mean over a pixel, from x0 to x1, and over the time of how much is not covered; edge(t) is where
/// the plate ends.
template <class Edge>
double uncovered(double x0, double x1, const Edge& edge) {
    constexpr int steps = 20000;
    double sum = 0;
    for (int i = 0; i < steps; ++i)
        sum += std::clamp((x1 - edge((i + 0.5) / steps)) / (x1 - x0), 0.0, 1.0);
    return sum / steps;
}

bool is_same(const RenderedLayers& a, const RenderedLayers& b) {
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const auto p = a.film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
            const auto q = b.film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
            if (std::memcmp(&p, &q, sizeof(p)) != 0) return false;
        }
    }
    return true;
}

}  // namespace

TEST(MotionBlur, OfAnEdgeHasTheProfileOfItsMotion) {
    // Fast, back, slow: three segments
    const std::vector<float> at_key = {-0.7f, 0.6f, 0.1f, 0.3f};
    const TestScene test =
        plate_before_wall(half_plane(at_key[0]),
                          {half_plane(at_key[1]), half_plane(at_key[2]), half_plane(at_key[3])});
    const auto edge = [&](double t) {
        const auto segment = std::min(size_t(t * 3), size_t(2));
        const double a = double(at_key[segment]), b = double(at_key[segment + 1]);
        return a + (b - a) * (t * 3 - double(segment));
    };
    const RenderedLayers layers = render(test, {.size = size, .samples = 1024, .last_bounce = 0});
    double worst = 0, worst_mean = 0;
    for (int x = 0; x < size; ++x) {
        const double x0 = -1 + 2.0 * x / size, x1 = -1 + 2.0 * (x + 1) / size;
        const double expected = uncovered(x0, x1, edge);
        double sum = 0;
        for (int y = 0; y < size; ++y) {
            sum += pixel(layers, x, y);
            worst = hardcase::larger(worst, std::abs(pixel(layers, x, y) - expected));
        }
        worst_mean = hardcase::larger(worst_mean, std::abs(sum / size - expected));
    }
    fmt::print("profile of an edge: worst pixel {:.1e}, worst column {:.1e}\n", worst, worst_mean);
    // Time and place are spread well each by itself: 1024 samples are worth a few hundred that are
    // spread well together
    EXPECT_LT(worst, 0.02);
    EXPECT_LT(worst_mean, 1e-3);
}

// A shutter that opens and closes slowly weighs the profile.
TEST(MotionBlur, OfAnEdgeHasTheProfileOfItsShutterCurve) {
    TestScene test = plate_before_wall(half_plane(-0.8f), {half_plane(0.8f)});
    test.scene.camera.shutter_full = 0.25;
    test.scene.camera.shutter_falling = 0.5;
    const RenderedLayers layers = render(test, {.size = size, .samples = 1024, .last_bounce = 0});
    const auto opening = [](double t) { return std::min({t / 0.25, (1 - t) / 0.5, 1.0}); };
    double worst = 0;
    for (int x = 0; x < size; ++x) {
        const double x0 = -1 + 2.0 * x / size, x1 = -1 + 2.0 * (x + 1) / size;
        constexpr int steps = 20000;
        double expected = 0, whole = 0, found = 0;
        for (int i = 0; i < steps; ++i) {
            const double t = (i + 0.5) / steps, edge = -0.8 + 1.6 * t;
            whole += opening(t);
            expected += opening(t) * std::clamp((x1 - edge) / (x1 - x0), 0.0, 1.0);
        }
        for (int y = 0; y < size; ++y) found += pixel(layers, x, y) / size;
        worst = hardcase::larger(worst, std::abs(found - expected / whole));
    }
    fmt::print("profile of an edge by a slow shutter: worst column {:.1e}\n", worst);
    EXPECT_LT(worst, 1e-3);
}

/// The camera goes one way, or what it sees the other: the same rays meet the same plate, but for
/// rounding.
TEST(MotionBlur, OfACameraIsThatOfAllItSees) {
    const std::vector<float> at_key = {-0.7f, 0.6f, 0.1f, 0.3f};
    const TestScene plate =
        plate_before_wall(half_plane(at_key[0]),
                          {half_plane(at_key[1]), half_plane(at_key[2]), half_plane(at_key[3])});
    TestScene camera = plate_before_wall(half_plane(0), {});
    for (const float x : at_key) {
        Mat4d key = camera.scene.camera.render_from_camera;
        key[3][0] -= double(x);
        camera.scene.camera.motion_keys.push_back(key);
    }
    const TestRenderOptions options = {.size = size, .samples = 256, .last_bounce = 0};
    const RenderedLayers a = render(plate, options), b = render(camera, options);
    double worst = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            worst = hardcase::larger(worst, std::abs(pixel(a, x, y) - pixel(b, x, y)));
    fmt::print("the camera or the plate: worst pixel {:.1e}\n", worst);
    // One sample of 256 at the edge
    EXPECT_LE(worst, 1.01 / 256);
}

TEST(H47Motion, ATurningWedgeHasTheProfileOfItsMotion) {
    // From 0 to 90 degrees over 32 segments, about the middle of the image
    constexpr int segments = 32;
    constexpr double width = 0.3;
    const auto wedge = [&](double angle) {
        std::vector<Vec3> corners = {{0, 0, -2}};
        for (const double a : {angle - width / 2, angle + width / 2})
            corners.emplace_back(float(1.6 * std::cos(a)), float(1.6 * std::sin(a)), -2.0f);
        return corners;
    };
    std::vector<std::vector<Vec3>> keys;
    for (int k = 1; k <= segments; ++k) keys.push_back(wedge(pi_d / 2 * k / segments));
    const TestScene test = plate_before_wall(wedge(0), std::move(keys));
    const RenderedLayers layers = render(test, {.size = size, .samples = 1024, .last_bounce = 0});
    double sum = 0, squares = 0, worst = 0, ring_sum = 0;
    size_t count = 0, ring_count = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            // Time that the wedge covers the middle of the pixel, for pixels far from the apex and
            // not near where the profile bends
            const double px = -1 + (2.0 * x + 1) / size, py = 1 - (2.0 * y + 1) / size;
            const double r = std::hypot(px, py), angle = std::atan2(py, px);
            if (px < 0.1 || py < 0.1 || r > 1.4) continue;
            const double first = std::max(angle - width / 2, 0.0);
            const double last = std::min(angle + width / 2, pi_d / 2);
            const double bend =
                std::min(std::abs(angle - width / 2), std::abs(angle + width / 2 - pi_d / 2));
            if (bend * r < 3.0 / size) continue;
            const double expected = 1 - (last - first) / (pi_d / 2);
            sum += pixel(layers, x, y) - expected;
            squares += (pixel(layers, x, y) - expected) * (pixel(layers, x, y) - expected);
            ++count;
            if (r > 0.5 && r < 0.8) {
                ring_sum += pixel(layers, x, y) - expected;
                ++ring_count;
            }
            worst = hardcase::larger(worst, std::abs(pixel(layers, x, y) - expected));
        }
    }
    fmt::print("profile of a wedge: worst pixel {:.1e}, mean {:+.1e} over {}, ring {:+.1e}\n",
               worst, sum / double(count), count, ring_sum / double(ring_count));
    EXPECT_GT(count, 500u);
    EXPECT_LT(worst, 0.02);
    hardcase::expect_within(
        {"blur of a wedge that turns by 90 degrees, mean deviation", std::abs(sum / double(count)),
         1e-3, 5.2816 * std::sqrt(squares) / double(count), "time that it covers a pixel"});
    EXPECT_LT(std::abs(ring_sum / double(ring_count)), 1e-3);
}

// Shadow rays see the scene at the time of their path: a plate that crosses the light for a third
// of the time takes a third of it, also from a receiver that moves along below.
TEST(MotionBlur, OfShadowsIsThatOfTheTimeOfThePath) {
    for (const bool moves_along : {false, true}) {
        TestScene test;
        test.look_at_point(0.01);
        scene::Mesh floor;
        floor.points = {{-4, -4, -3}, {4, -4, -3}, {4, 4, -3}, {-4, 4, -3}};
        floor.face_vertex_counts = {4};
        floor.face_vertex_indices = {0, 1, 2, 3};
        if (moves_along) {
            floor.later_points = {floor.points};
            for (Vec3& p : floor.later_points[0]) p.x += 1;
        }
        scene::Shape shape;
        shape.geometry = floor;
        shape.material = test.add_matte(Rgb(0.5f));
        test.scene.shapes.push_back(shape);
        // Out of sight, between floor and light: over the axis from 1/3 to 2/3 of the time
        scene::Mesh plate = floor;
        plate.points = {{-2, -1, 1}, {-1, -1, 1}, {-1, 1, 1}, {-2, 1, 1}};
        plate.later_points = {plate.points};
        for (Vec3& p : plate.later_points[0]) p.x += 3;
        shape.geometry = plate;
        test.scene.shapes.push_back(shape);
        test.add_light(scene::LightKind::Distant, Mat4d()).angle_deg = 0.0f;
        TestScene open = test;
        open.scene.shapes.pop_back();
        const double without = render(open, {.size = 8, .samples = 4}).bounce(1).mean;
        ASSERT_GT(without, 0.0);
        expect_close(render(test, {.size = 32, .samples = 1024}).bounce(1), without * 2 / 3, 1e-3,
                     moves_along ? "shadow on a floor that moves" : "shadow on a floor that stays");
    }
}

// An instance that moves blurs as its points do.
TEST(MotionBlur, OfAnInstanceIsThatOfItsPoints) {
    const TestScene points =
        plate_before_wall(half_plane(-0.5f), {half_plane(0.5f), half_plane(0.25f)});
    TestScene placed = plate_before_wall(half_plane(0), {});
    Mat4 key;
    const auto at_x = [&](float x) {
        key[3][0] = x;
        return key;
    };
    placed.make_instance(at_x(-0.5f));
    placed.scene.instances[0].later_render_from_prototype = {at_x(0.5f), at_x(0.25f)};
    const TestRenderOptions options = {.size = size, .samples = 64, .last_bounce = 0};
    const RenderedLayers a = render(points, options), b = render(placed, options);
    double worst = 0, max = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            worst = hardcase::larger(worst, std::abs(pixel(a, x, y) - pixel(b, x, y)));
            max = hardcase::larger(max, pixel(a, x, y) * (1 - pixel(a, x, y)));
        }
    }
    // Rounding may decide a sample at the very edge
    EXPECT_LE(worst, 1.0 / 64 + 1e-9);
    EXPECT_GT(max, 0.2);
}

TEST(H47Motion, IsNoneWhenTheShutterIsClosedBitForBit) {
    const std::vector<Vec3> corners = half_plane(0.123f);
    const TestScene still = plate_before_wall(corners, {});
    const TestScene closed = plate_before_wall(corners, {corners, corners});
    const TestRenderOptions options = {.size = size, .samples = 16, .last_bounce = 0};
    hardcase::expect_within({"pictures that equal keys change, bit for bit",
                             is_same(render(still, options), render(closed, options)) ? 0.0 : 1.0,
                             0, 0, "the static picture"});
    // And something moves when it does
    const TestScene moving = plate_before_wall(corners, {half_plane(0.2f)});
    EXPECT_FALSE(is_same(render(still, options), render(moving, options)));
    // Motion elsewhere changes no sample here: numbers of other purposes are not shifted by it
    TestScene beside = still;
    scene::Shape far = moving.scene.shapes.back();
    for (Vec3& p : std::get<scene::Mesh>(far.geometry).points) p.y += 100;
    for (Vec3& p : std::get<scene::Mesh>(far.geometry).later_points[0]) p.y += 100;
    beside.scene.shapes.push_back(far);
    EXPECT_TRUE(is_same(render(still, options), render(beside, options)));
}

}  // namespace velatura::test
