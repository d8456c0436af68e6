// SPDX-License-Identifier: Apache-2.0
// Lights that move while the shutter is open: at each time they are the lights that stand there.
#include "emissive_fixtures.h"
#include "lights/emitter.h"
#include "lights/light_bounds.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace velatura::lights {
namespace {

using scene::LightKind;

constexpr float times[] = {0.0f, 0.21f, 0.5f, 0.83f, 1.0f};

Mat4d turned(double angle, const Vec3d& axis, const Vec3d& to, double scale = 1.0) {
    Mat4d m;
    m.setAxisAngle(axis.normalized(), angle);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) m[i][k] *= scale;
    for (int k = 0; k < 3; ++k) m[3][k] = to[k];
    return m;
}

/// Keys of a motion; entries go straight on between.
Mat4d between_keys(const std::vector<Mat4d>& keys, double time) {
    const double x = time * double(keys.size() - 1);
    const size_t segment = std::min(size_t(x), keys.size() - 2);
    const double f = x - double(segment);
    return keys[segment] * (1.0 - f) + keys[segment + 1] * f;
}

scene::Light moving(LightKind kind, const std::vector<Mat4d>& keys) {
    scene::Light light = light_of(kind, keys[0]);
    light.later_render_from_light.assign(keys.begin() + 1, keys.end());
    light.radius = 0.4f;
    light.angle_deg = 20.0f;
    return light;
}

struct Prepared {
    explicit Prepared(std::vector<scene::Light> all) : scene(scene_of(std::move(all))) {}

    scene::Scene scene;
    Diagnostics diagnostics;
    LightSet lights{scene, {}, diagnostics};
};

/// The same, standing where it is at the time.
Prepared standing(const scene::Light& light, const std::vector<Mat4d>& keys, double time) {
    scene::Light still = light;
    still.later_render_from_light.clear();
    still.render_from_light = between_keys(keys, time);
    return Prepared({still});
}

constexpr LightKind kinds[] = {LightKind::Rect,     LightKind::Disk,    LightKind::Sphere,
                               LightKind::Cylinder, LightKind::Distant, LightKind::Dome};

/// Small steps: what is between two of them is rigid but for 1e-4.
std::vector<Mat4d> rigid_keys() {
    std::vector<Mat4d> keys;
    for (int k = 0; k <= 16; ++k)
        keys.push_back(turned(0.05 * k, {1, 2, 0.5}, {0.3 * k / 16.0, -0.2, -2.0 + 0.1 * k}));
    return keys;
}

}  // namespace

TEST(MovingLights, AreTheLightsThatStandThere) {
    const std::vector<Mat4d> keys = rigid_keys();
    int compared = 0;
    for (const LightKind kind : kinds) {
        scene::Light light = moving(kind, keys);
        if (kind == LightKind::Rect) {
            light.shaping.is_active = true;
            light.shaping.cone_angle_deg = 50.0f;
        }
        const Prepared moves({light});
        EXPECT_TRUE(moves.lights.has_motion());
        for (const float time : times) {
            const Prepared stands = standing(light, keys, double(time));
            EXPECT_FALSE(stands.lights.has_motion());
            for (int i = 0; i < 64; ++i) {
                const Vec3 p(0.1f * float(i % 5), -0.3f, -4.0f + 0.2f * float(i % 7));
                const Vec2 u((float(i % 8) + 0.5f) / 8.0f, (float(i / 8) + 0.5f) / 8.0f);
                const auto s = moves.lights.sample(0, p, u, {}, time);
                if (!s || s->is_delta) continue;
                // One density for all ways to find a direction, the same as that of the light that
                // stands there
                EXPECT_NEAR(moves.lights.pdf(0, p, s->wi, time), s->pdf, 1e-4f * s->pdf);
                const auto hit = moves.lights.intersect(0, p, s->wi, time),
                           still = stands.lights.intersect(0, p, s->wi);
                if (!hit || !still) continue;  // at the rim
                ++compared;
                if (std::isfinite(still->t)) {
                    EXPECT_NEAR(hit->t, still->t, 2e-3f * still->t) << int(kind);
                }
                EXPECT_NEAR(hit->pdf, still->pdf, 5e-3f * still->pdf) << int(kind) << " " << time;
                EXPECT_NEAR(hit->Le.x, still->Le.x, 1e-2f) << int(kind);
            }
        }
    }
    EXPECT_GT(compared, 600);
}

// Scales and shears: sampled otherwise than a light that stands there, with the same mean.
TEST(MovingLights, BringTheIrradianceOfLightsThatStandThere) {
    const std::vector<Mat4d> keys = {
        matrix_of({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 3}),
        matrix_of({1.5, 0.2, 0}, {-0.3, 0.7, 0.1}, {0, 0.4, 1.2}, {0.8, -0.2, 2})};
    double worst = 0, detectable = 0;
    for (const LightKind kind :
         {LightKind::Rect, LightKind::Disk, LightKind::Sphere, LightKind::Cylinder}) {
        const scene::Light light = moving(kind, keys);
        const Prepared moves({light});
        for (const float time : {0.3f, 0.8f}) {
            const Prepared stands = standing(light, keys, double(time));
            const Vec3 p(0.1f, 0.2f, 0.0f), n(0, 0, 1);
            const auto of = [&](const LightSet& lights, float at) {
                return integrate(4096, [&](const Vec2& u) {
                    const auto s = lights.sample(0, p, u, {}, at);
                    if (!s) return 0.0;
                    return double(s->Le.x) * std::max(0.0, double(n.dot(s->wi))) / double(s->pdf);
                });
            };
            const Estimate a = of(moves.lights, time), b = of(stands.lights, 0.0f);
            const double sigma = std::hypot(a.standard_error, b.standard_error) + 1e-7;
            EXPECT_LT(std::abs(a.mean - b.mean), 4.0 * sigma + 1e-5 * b.mean) << int(kind);
            worst = std::max(worst, std::abs(a.mean / b.mean - 1.0));
            detectable = std::max(detectable, 5.2816 * sigma / b.mean);
            // And by points of the light, as caustics are sought from
            const Estimate points = integrate(4096, [&](const Vec2& u) {
                const EmitterPoint q = moves.lights.sample_point(0, u, std::nullopt, time);
                const Vec3d way = q.p - Vec3d(p);
                const double distance2 = way.dot(way);
                const Vec3d d = way / std::sqrt(distance2);
                const double Le = double(moves.lights.radiance_at(0, q, Vec3d(p), d, time).x);
                return Le * std::max(0.0, d.z) * std::abs(q.n.dot(d)) / (distance2 * q.pdf);
            });
            EXPECT_LT(std::abs(points.mean - b.mean),
                      4.0 * std::hypot(points.standard_error, b.standard_error) + 1e-4 * b.mean)
                << int(kind);
        }
    }
    fmt::print("irradiance of lights that move and shear: worst {:.1e}, detectable {:.1e}\n", worst,
               detectable);
}

TEST(MovingLights, AreInsideTheirBoundsAndChosenAtAnyTime) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::vector<scene::Light> lights;
    std::vector<std::vector<Mat4d>> all_keys;
    for (int i = 0; i < 40; ++i) {
        std::vector<Mat4d> keys;
        const Vec3d axis(unit(random), unit(random), 1.0);
        for (int k = 0; k <= 1 << (i % 3); ++k)
            keys.push_back(turned(0.4 * k, axis,
                                  {4 * unit(random), 4 * unit(random), 4 * unit(random)},
                                  0.5 + 0.1 * k));
        all_keys.push_back(keys);
        lights.push_back(moving(kinds[size_t(i % 4)], keys));
    }
    const Prepared moves(lights);
    const auto selector = make_light_selector(moves.lights, Box3(Vec3(-8.0f), Vec3(8.0f)));
    int reached = 0;
    for (const float time : times) {
        for (uint32_t i = 0; i < 40; ++i) {
            const Prepared stands = standing(lights[i], all_keys[i], double(time));
            const Box3d inner = stands.lights.bounds(0).box, outer = moves.lights.bounds(i).box;
            for (int k = 0; k < 3; ++k) {
                EXPECT_GE(inner.min[k], outer.min[k] - 1e-9);
                EXPECT_LE(inner.max[k], outer.max[k] + 1e-9);
            }
        }
        for (int r = 0; r < 20; ++r) {
            Receiver at{Vec3(Vec3d(5 * unit(random), 5 * unit(random), 5 * unit(random)))};
            at.n = normalize(Vec3(Vec3d(unit(random), unit(random), 0.1 + unit(random))));
            at.both_sides = false;
            at.time = time;
            double sum = 0;
            for (uint32_t i = 0; i < 40; ++i) {
                const double pmf = double(selector->pmf(at, i));
                sum += pmf;
                const auto s = moves.lights.sample(i, at.p, {0.4f, 0.7f}, {}, time);
                if (!s || is_black(s->Le) || !(s->wi.dot(at.n) > 0.0f)) continue;
                ++reached;
                EXPECT_GT(pmf, 0.0) << "light " << i << " at " << time;
            }
            const auto choice = selector->select(at, 0.37);
            EXPECT_EQ(choice.has_value(), sum > 0.0) << "nothing shines there";
            if (!choice) continue;
            EXPECT_NEAR(sum, 1.0, 1e-4);
            EXPECT_EQ(choice->pmf, selector->pmf(at, choice->light));
        }
        // A ray meets what stands there
        for (uint32_t i = 0; i < 40; ++i) {
            const Vec3 o(0.1f, 0.2f, 12.0f);
            const auto s = moves.lights.sample(i, o, {0.5f, 0.5f}, {}, time);
            if (!s) continue;
            bool is_met = false;
            moves.lights.for_each_hit(o, s->wi, 1e9f, time, [&](const LightHit& hit) {
                is_met = is_met || hit.light == i;
            });
            EXPECT_TRUE(is_met) << i;
        }
    }
    EXPECT_GT(reached, 500);
}

TEST(MovingLights, EmissiveTrianglesAreWhereTheirMeshIs) {
    EmissiveStage moves;
    const auto fill = [](EmissiveStage& stage, double time, bool is_still) {
        const auto warm = stage.add_material(Rgb(3, 2, 1));
        const std::vector<Vec3> first = {{-1, -1, 2}, {1, -1, 2},   {0.5f, 1, 3},
                                         {3, 0, 1},   {4, 0, 1.5f}, {3, 1, 2}};
        const std::vector<Vec3> last = {{-2, -1, 3}, {1, -2, 2},   {0.5f, 2, 1},
                                        {3, 1, -1},  {4.5f, 0, 1}, {3, 1, 2}};
        scene::Shape bends = EmissiveStage::triangles(first, warm);
        auto& mesh = std::get<scene::Mesh>(bends.geometry);
        const auto f = float(time);
        if (is_still) {
            for (size_t i = 0; i < first.size(); ++i)
                mesh.points[i] = first[i] + (last[i] - first[i]) * f;
        } else {
            mesh.later_points = {last};
        }
        stage.scene.shapes.push_back(bends);
        scene::Shape lamp = EmissiveStage::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f}}, warm);
        stage.scene.prototypes.push_back({"/Lamp", {lamp}});
        for (int i = 0; i < 20; ++i) {
            const Mat4 a(turned(0.3 * i, {1, 1, 0}, {double(i % 5) - 2, double(i / 5), 4.0})),
                b(turned(0.3 * i + 0.5, {1, 1, 0}, {double(i % 5), double(i / 5) - 2, 1.0}));
            stage.add_instance(0, is_still ? a * (1.0f - f) + b * f : a);
            if (!is_still) stage.scene.instances.back().later_render_from_prototype = {b};
        }
        stage.prepare();
    };
    fill(moves, 0.0, false);
    const auto selector = make_light_selector(*moves.lights, Box3(Vec3(-8.0f), Vec3(8.0f)));
    int compared = 0, reached = 0;
    for (const float time : times) {
        EmissiveStage stands;
        fill(stands, double(time), true);
        for (int r = 0; r < 8; ++r) {
            const Vec3 p(0.7f * float(r) - 2.0f, 0.3f, -0.5f);
            Receiver at{p, Vec3(0, 0, 1), false};
            at.time = time;
            double sum = 0;
            for (const LightId id : moves.all()) {
                const double pmf = double(selector->pmf(at, id));
                sum += pmf;
                const auto s = moves.lights->sample(id, p, {0.3f, 0.6f}, {}, time),
                           t = stands.lights->sample(id, p, {0.3f, 0.6f});
                ASSERT_EQ(s.has_value(), t.has_value());
                if (!s) continue;
                ++compared;
                EXPECT_NEAR((s->wi - t->wi).length(), 0.0f, 1e-4f);
                EXPECT_NEAR(s->pdf, t->pdf, 1e-3f * t->pdf);
                EXPECT_EQ(s->Le, t->Le);
                const Vec3 q = p + s->wi * s->distance;
                EXPECT_NEAR(moves.lights->surface_pdf(id, p, q, time), s->pdf, 1e-3f * s->pdf);
                const auto hit = moves.lights->intersect(id, p, s->wi, time);
                if (hit) {
                    EXPECT_NEAR(hit->pdf, s->pdf, 1e-3f * s->pdf);
                }
                if (!(s->wi.z > 0.0f)) continue;
                ++reached;
                EXPECT_GT(pmf, 0.0);
            }
            EXPECT_NEAR(sum, 1.0, 1e-4);
            for (int i = 0; i < 16; ++i) {
                const auto choice = selector->select(at, (i + 0.5) / 16.0);
                ASSERT_TRUE(choice);
                EXPECT_EQ(choice->pmf, selector->pmf(at, choice->light));
            }
        }
    }
    EXPECT_GT(compared, 500);
    EXPECT_GT(reached, 300);
}

}  // namespace velatura::lights
