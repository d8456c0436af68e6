// SPDX-License-Identifier: Apache-2.0
// Light filters, one by one: closed forms of what they do to the radiance of a segment, and that
// every way to sample a light finds the same.
#include "light_fixtures.h"
#include "lights/emitter.h"
#include "lights/light_bounds.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace velatura::lights {
namespace {

using scene::FilterProjection;
using scene::LightKind;

scene::LightFilter filter_of(scene::FilterShape shape, const Mat4d& m = Mat4d()) {
    scene::LightFilter filter;
    filter.parent_from_filter = m;
    filter.shape = std::move(shape);
    return filter;
}

scene::LightFilter tinted(const Rgb& tint) {
    scene::LightFilter filter = filter_of(scene::IntensityFilter());
    filter.tint = tint;
    return filter;
}

/// 2 × 2 texels: red and green above, blue and white below.
Result<EnvironmentImage> four_texels(const scene::Light&) {
    return EnvironmentImage{2, 2, {Rgb(1, 0, 0), Rgb(0, 1, 0), Rgb(0, 0, 1), Rgb(1, 1, 1)}};
}

/// A scene of one light, with its lights.
struct Lit {
    scene::Scene scene;
    Diagnostics diagnostics;
    LightSet lights;

    explicit Lit(const scene::Light& light, const LightSetOptions& options = {})
        : scene(scene_of({light})), lights(scene, four_texels, diagnostics, options) {}
};

scene::Light with(scene::Light light, std::vector<scene::LightFilter> filters) {
    light.filters = std::move(filters);
    return light;
}

/// Every kind, none of them small or hidden, above the plane z = 0.
std::vector<scene::Light> all_lights() {
    std::vector<scene::Light> lights;
    for (const LightKind kind : {LightKind::Rect, LightKind::Disk, LightKind::Sphere,
                                 LightKind::Cylinder, LightKind::Distant, LightKind::Dome}) {
        lights.push_back(light_of(kind, translation(0.2, -0.1, 2.0)));
        lights.back().Le = Rgb(2.0f, 1.0f, 0.5f);
        lights.back().angle_deg = 40.0f;
    }
    return lights;
}

/// One filter of every kind, without hard edges, where receivers near the origin see all of it.
std::vector<scene::LightFilter> soft_filters() {
    scene::RampFilter ramp;
    ramp.end = 4.0f;
    ramp.knots = {0.0f, 0.5f, 1.0f};
    ramp.colors = {Rgb(1.0f), Rgb(0.8f, 0.4f, 0.2f), Rgb(0.1f)};
    scene::RodFilter rod;
    rod.box.edge = 2.0f;
    scene::BarnDoorFilter doors;
    doors.opening = {Vec3(-0.3f, -0.2f, 0), Vec3(0.2f, 0.3f, 0), 0.1f};
    doors.opening.edge = 1.5f;
    doors.slope_upper = Vec2(0.2f, -0.1f);
    scene::GoboFilter gobo;
    gobo.width = 4.0f;
    gobo.height = 3.0f;
    gobo.outside = scene::GoboFilter::Outside::Clamp;
    gobo.texture_file = "gobo.exr";
    std::vector<scene::LightFilter> filters = {
        tinted(Rgb(0.5f, 0.25f, 0.75f)), filter_of(ramp), filter_of(rod),
        filter_of(doors, translation(0, 0, 1)), filter_of(gobo, translation(0.1, 0, 1.2))};
    filters[2].tint = Rgb(0.2f, 0.3f, 0.1f);
    filters[3].density = 0.75f;
    filters[4].saturation = 0.5f;
    return filters;
}

const Vec3 receivers[] = {{0, 0, 0}, {0.5f, 0.25f, 0.1f}, {-1.0f, 0.75f, -0.5f}, {2, -2, 0.25f}};

template <class Visit>
void for_each_sample(const LightSet& lights, int count, const Visit& visit) {
    for (const Vec3& p : receivers)
        for (int i = 0; i < count; ++i) {
            const sampling::PixelSampler sampler(5, 1, 2, uint64_t(i));
            const Vec2 u = sampler.get_2d(0, sampling::Purpose::LightSurface);
            if (const auto s = lights.sample(0, p, u)) visit(p, u, *s);
        }
}

TEST(LightFilters, IntensityIsAScaledColor) {
    const Rgb tint(0.5f, 0.25f, 4.0f);
    for (const scene::Light& plain : all_lights()) {
        scene::Light scaled = plain;
        scaled.Le *= tint;
        const Lit a(with(plain, {tinted(tint)})), b(scaled);
        int count = 0;
        for_each_sample(a.lights, 50, [&](const Vec3& p, const Vec2& u, const LightSample& s) {
            const auto other = b.lights.sample(0, p, u);
            ASSERT_TRUE(other);
            EXPECT_EQ(s.Le, other->Le);
            EXPECT_EQ(s.pdf, other->pdf);
            EXPECT_EQ(s.wi, other->wi);
            ++count;
        });
        EXPECT_GT(count, 50);
    }
}

TEST(LightFilters, EveryStrategySeesTheSameRadiance) {
    const std::vector<scene::LightFilter> filters = soft_filters();
    double largest = 0.0;
    int changed = 0;
    for (const scene::Light& plain : all_lights()) {
        for (size_t k = 0; k <= filters.size(); ++k) {
            // Each alone, then all in a row
            const auto some = k < filters.size() ? std::vector{filters[k]} : filters;
            const Lit filtered(with(plain, some)), bare(plain);
            for_each_sample(
                filtered.lights, 25, [&](const Vec3& p, const Vec2& u, const LightSample& s) {
                    const auto hit = filtered.lights.intersect(0, p, s.wi);
                    if (!hit) return;  // a direction rounded past the rim
                    for (int c = 0; c < 3; ++c)
                        largest = std::max(largest, double(std::abs(hit->Le[c] - s.Le[c])));
                    const auto unfiltered = bare.lights.sample(0, p, u);
                    changed += unfiltered && unfiltered->Le != s.Le;
                    EXPECT_EQ(filtered.lights.unfiltered_radiance(*hit, p, s.wi),
                              bare.lights.intersect(0, p, s.wi)->Le);
                    EXPECT_EQ(s.pdf, unfiltered->pdf);
                    if (plain.kind == LightKind::Dome) return;
                    // A chain of a caustic ends in a point of the light
                    EmitterPoint point;
                    const Vec3d o(p), d(s.wi);
                    point.p = o + d * double(s.distance);
                    point.n = plain.kind == LightKind::Distant ? d : Vec3d(0, 0, -1);
                    if (plain.kind == LightKind::Sphere || plain.kind == LightKind::Cylinder)
                        return;
                    const Rgb at = filtered.lights.radiance_at(0, point, o, d);
                    for (int c = 0; c < 3; ++c)
                        largest = std::max(largest, double(std::abs(at[c] - s.Le[c])));
                });
        }
    }
    EXPECT_LT(largest, 2e-5);
    EXPECT_GT(changed, 1000);
    RecordProperty("largest", fmt::format("{}", largest));
    fmt::print("largest difference {:.3g} of radiances up to 2\n", largest);
}

TEST(LightFilters, RampsAreWhatTheirKnotsSay) {
    using Ramp = scene::RampFilter;
    const auto value = [](const Ramp& ramp, const Vec3& p, bool is_inverted = false) {
        scene::LightFilter filter = filter_of(ramp, translation(0, 0, 3));
        filter.is_inverted = is_inverted;
        scene::Light light = light_of(LightKind::Distant);
        light.angle_deg = 0.0f;
        const Lit lit(with(light, {filter}));
        return lit.lights.sample(0, p, Vec2(0.5f))->Le.x;
    };
    Ramp ramp;
    ramp.begin = 1.0f;
    ramp.end = 3.0f;
    ramp.knots = {0.0f, 1.0f};
    ramp.colors = {Rgb(1.0f), Rgb(0.25f)};
    ramp.measure = Ramp::Measure::FromPoint;
    EXPECT_EQ(value(ramp, {0, 0, 3}), 1.0f);
    EXPECT_EQ(value(ramp, {0, 0, 0}), 0.25f);
    EXPECT_NEAR(value(ramp, {1.5f, 0, 3}), 1.0 - 0.75 * 0.25, 1e-6);
    EXPECT_NEAR(value(ramp, {1.5f, 0, 3}, true), 0.75 * 0.25, 1e-6);
    ramp.interpolation = Ramp::Interpolation::Smooth;
    EXPECT_NEAR(value(ramp, {1.5f, 0, 3}), 1.0 - 0.75 * (0.0625 * 2.5), 1e-6);
    ramp.interpolation = Ramp::Interpolation::Constant;
    EXPECT_EQ(value(ramp, {2.9f, 0, 3}), 1.0f);
    EXPECT_EQ(value(ramp, {3.1f, 0, 3}), 0.25f);
    ramp.interpolation = Ramp::Interpolation::Linear;
    ramp.measure = Ramp::Measure::AlongAxis;
    EXPECT_NEAR(value(ramp, {7, 5, 1}), 0.625, 1e-6);
    EXPECT_EQ(value(ramp, {7, 5, 4}), 1.0f);
    ramp.measure = Ramp::Measure::FromAxis;
    EXPECT_NEAR(value(ramp, {0, 2, -9}), 0.625, 1e-6);
    // Lights at infinity are behind all ramps
    ramp.measure = Ramp::Measure::ToLight;
    EXPECT_EQ(value(ramp, {0, 0, 0}), 0.25f);
}

TEST(LightFilters, DecayGoesByTheDistanceToThePointOfTheLight) {
    scene::RampFilter near, far;
    near.begin = 1.0f;
    near.end = 2.0f;
    near.knots = far.knots = {0.0f, 1.0f};
    near.colors = {Rgb(0.0f), Rgb(1.0f)};
    far.begin = 3.0f;
    far.end = 6.0f;
    far.colors = {Rgb(1.0f), Rgb(0.0f)};
    const Lit lit(
        with(light_of(LightKind::Rect, translation(0, 0, 0)), {filter_of(near), filter_of(far)}));
    int between = 0;
    for (const float z : {-0.25f, -1.2f, -1.7f, -2.5f, -4.0f, -5.5f, -7.0f})
        for (int i = 0; i < 16; ++i) {
            const auto s = lit.lights.sample(0, {0.3f, 0, z}, Vec2(float(i) / 16.0f, 0.3f));
            ASSERT_TRUE(s);
            const double d = double(s->distance);
            const double expected =
                std::clamp(d - 1.0, 0.0, 1.0) * std::clamp((6.0 - d) / 3.0, 0.0, 1.0);
            EXPECT_NEAR(double(s->Le.x), expected, 1e-6) << d;
            between += expected > 0.0 && expected < 1.0;
        }
    EXPECT_GT(between, 30);
}

TEST(LightFilters, RodsChangeTheLightOfReceiversWithin) {
    scene::RodFilter rod;
    rod.box.lower = Vec3(-1, -0.5f, -0.25f);
    rod.box.upper = Vec3(1, 0.5f, 0.25f);
    rod.box.radius = 0.1f;
    rod.box.edge = 0.4f;
    rod.box.edge_upper.x = 2.0f;
    scene::LightFilter filter = filter_of(rod);
    filter.tint = Rgb(0.2f);
    scene::Light light = light_of(LightKind::Distant);
    light.angle_deg = 0.0f;
    const auto value = [&](const Vec3& p) {
        const Lit lit(with(light, {filter}));
        return double(lit.lights.sample(0, p, Vec2(0.5f))->Le.x);
    };
    EXPECT_FLOAT_EQ(float(value({0, 0, 0})), 0.2f);
    EXPECT_FLOAT_EQ(float(value({1.09f, 0, 0})), 0.2f);
    EXPECT_NEAR(value({-1.3f, 0, 0}), 0.6, 1e-6);  // the middle of an edge
    EXPECT_NEAR(value({1.5f, 0, 0}), 0.6, 1e-6);   // of one twice as wide
    EXPECT_EQ(value({-1.51f, 0, 0}), 1.0);
    // Round corners: half an edge away from where two sides would meet
    const float corner = 0.3f / std::sqrt(2.0f);
    EXPECT_NEAR(value({-1.0f - corner, -0.5f - corner, 0}), 0.6, 1e-6);
    filter.is_inverted = true;
    EXPECT_EQ(value({0, 0, 0}), 1.0);
    EXPECT_FLOAT_EQ(float(value({-1.51f, 0, 0})), 0.2f);
    filter.density = 0.5f;
    EXPECT_NEAR(value({-1.51f, 0, 0}), 0.6, 1e-6);
    // Scale is of the box and its radius
    filter.is_inverted = false;
    filter.density = 1.0f;
    rod.box.scale = Vec3(2.0f, 1.0f, 1.0f);
    filter.shape = rod;
    EXPECT_FLOAT_EQ(float(value({2.19f, 0, 0})), 0.2f);
    EXPECT_NEAR(value({-2.4f, 0, 0}), 0.6, 1e-6);
}

TEST(LightFilters, OpenBarnDoorsChangeNoBit) {
    scene::BarnDoorFilter doors;
    doors.opening = {Vec3(-50, -50, 0), Vec3(50, 50, 0)};
    for (const scene::Light& plain : all_lights()) {
        const Lit open(with(plain, {filter_of(doors, translation(0, 0, 1))})), bare(plain);
        int count = 0;
        for_each_sample(open.lights, 50, [&](const Vec3& p, const Vec2& u, const LightSample& s) {
            // Where the plane is passed farther out than the doors reach, they are closed
            if (std::abs(s.wi.z) < 0.05f) return;
            const auto other = bare.lights.sample(0, p, u);
            ASSERT_TRUE(other);
            EXPECT_EQ(s.Le, other->Le);
            ++count;
        });
        EXPECT_GT(count, 50);
    }
}

TEST(LightFilters, BarnDoorsLetThroughWhatCrossesTheOpening) {
    // The half plane x > 0.5 at z = 1, of a light above, and its counterpart
    scene::BarnDoorFilter doors;
    doors.opening = {Vec3(0.5f, -100, 0), Vec3(100, 100, 0)};
    scene::LightFilter filter = filter_of(doors, translation(0, 0, 1));
    int lit = 0, dark = 0;
    for (const bool is_inverted : {false, true}) {
        filter.is_inverted = is_inverted;
        const Lit set(with(light_of(LightKind::Rect, translation(0, 0, 2)), {filter}));
        for (int i = 0; i < 400; ++i) {
            const Vec3 p(-1.0f + float(i % 20) * 0.2f, float(i / 20) * 0.1f, 0.0f);
            const auto s = set.lights.sample(0, p, Vec2(float(i % 7) / 7.0f, 0.4f));
            ASSERT_TRUE(s);
            const float x = p.x + s->wi.x / s->wi.z;
            if (std::abs(x - 0.5f) < 1e-4f) continue;
            EXPECT_EQ(s->Le.x, (x > 0.5f) != is_inverted ? 1.0f : 0.0f) << p.x;
            (s->Le.x > 0.0f ? lit : dark) += 1;
        }
    }
    EXPECT_GT(lit, 100);
    EXPECT_GT(dark, 100);
    // Before the doors
    const auto before = [&](FilterProjection::Before what, const Vec3& p) {
        doors.projection.before = what;
        scene::Light small = light_of(LightKind::Rect, translation(0, 0, 2));
        small.width = small.height = 0.01f;
        const Lit set(with(small, {filter_of(doors, translation(0, 0, 1))}));
        return set.lights.sample(0, p, Vec2(0.5f))->Le.x;
    };
    using Before = FilterProjection::Before;
    EXPECT_EQ(before(Before::Unfiltered, {0, 0, 1.5f}), 1.0f);
    EXPECT_EQ(before(Before::Black, {0, 0, 1.5f}), 0.0f);
    // The line through (0, 0, 2) and the receiver meets the doors at 0.4, or at 0.6
    EXPECT_EQ(before(Before::Extended, {0.2f, 0, 1.5f}), 0.0f);
    EXPECT_EQ(before(Before::Extended, {0.3f, 0, 1.5f}), 1.0f);
}

TEST(LightFilters, TurnedDoorsAndProjectionsFollowTheirLines) {
    scene::BarnDoorFilter doors;
    doors.projection = {FilterProjection::Kind::Point, 1.0f, FilterProjection::Before::Extended};
    doors.opening = {Vec3(-1, -1, 0), Vec3(0.25f, 1, 0)};
    doors.slope_upper.x = 0.5f;
    scene::Light light = light_of(LightKind::Sphere);
    light.radius = 0.01f;
    const auto value = [&](const Vec3& p) {
        const Lit set(with(light, {filter_of(doors, translation(0, 0, -1))}));
        return set.lights.sample(0, p, Vec2(0.5f))->Le.x;
    };
    // At (x, y, −4) the line from the light passes (x, y) / 4; the door stands at 0.25 + y / 8
    EXPECT_EQ(value({0.95f, 0, -4}), 1.0f);
    EXPECT_EQ(value({1.05f, 0, -4}), 0.0f);
    EXPECT_EQ(value({1.15f, 0.4f, -4}), 1.0f);
    EXPECT_EQ(value({1.25f, 0.4f, -4}), 0.0f);
    EXPECT_EQ(value({0.85f, -0.4f, -4}), 0.0f);
    // Nearer than the doors, as if they stood there
    EXPECT_EQ(value({0.12f, 0, -0.5f}), 1.0f);
    EXPECT_EQ(value({0.13f, 0, -0.5f}), 0.0f);
    doors.projection.kind = FilterProjection::Kind::Parallel;
    EXPECT_EQ(value({0.24f, 0, -4}), 1.0f);
    EXPECT_EQ(value({0.26f, 0, -4}), 0.0f);
}

TEST(LightFilters, GobosShowTheTexelThatTheLightComesThrough) {
    scene::GoboFilter gobo;
    gobo.projection = {FilterProjection::Kind::Point, 1.0f, FilterProjection::Before::Black};
    gobo.width = 2.0f;
    gobo.texture_file = "gobo.exr";
    gobo.fill = Rgb(0.125f);
    scene::Light light = light_of(LightKind::Sphere);
    light.radius = 0.01f;
    const auto value = [&](const Vec3& p) {
        const Lit set(with(light, {filter_of(gobo, translation(0, 0, -1))}));
        EXPECT_TRUE(set.diagnostics.all().empty());
        return set.lights.sample(0, p, Vec2(0.5f))->Le;
    };
    // At z = −3 the image is 6 wide and 3 high; texels have their centers at a quarter of that
    EXPECT_EQ(value({-1.5f, 0.75f, -3}), Rgb(1, 0, 0));
    EXPECT_EQ(value({1.5f, 0.75f, -3}), Rgb(0, 1, 0));
    EXPECT_EQ(value({-1.5f, -0.75f, -3}), Rgb(0, 0, 1));
    EXPECT_EQ(value({1.5f, -0.75f, -3}), Rgb(1, 1, 1));
    const Rgb middle = value({0, 0, -3});
    EXPECT_NEAR(middle.x, 0.5, 1e-6);
    EXPECT_NEAR(middle.z, 0.5, 1e-6);
    EXPECT_EQ(value({3.5f, 0, -3}), gobo.fill);
    EXPECT_EQ(value({0, 0, -0.5f}), gobo.fill);
    gobo.outside = scene::GoboFilter::Outside::Repeat;
    EXPECT_EQ(value({4.5f, 0.75f, -3}), Rgb(1, 0, 0));
    gobo.outside = scene::GoboFilter::Outside::Clamp;
    EXPECT_EQ(value({-30, 30, -3}), Rgb(1, 0, 0));
    // A quarter turn to the left brings the right column up
    gobo.rotation_deg = 90.0f;
    gobo.width = 1.0f;
    const Rgb turned = value({-0.75f, 0.75f, -3});
    EXPECT_NEAR(turned.y, 1.0, 1e-5);
    EXPECT_NEAR(turned.x, 0.0, 1e-5);
}

TEST(LightFilters, SaturationKeepsTheLuminance) {
    scene::LightFilter filter = tinted(Rgb(1.0f));
    scene::Light light = light_of(LightKind::Dome);
    light.Le = Rgb(2.0f, 1.0f, 0.5f);
    const auto value = [&](float saturation) {
        filter.saturation = saturation;
        const Lit lit(with(light, {filter}));
        return lit.lights.sample(0, Vec3(0.0f), Vec2(0.3f))->Le;
    };
    const float gray = luminance(light.Le);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(value(0.0f)[c], gray, 1e-6);
        EXPECT_NEAR(value(0.5f)[c], 0.5f * (gray + light.Le[c]), 1e-6);
        EXPECT_NEAR(value(1.25f)[c], gray + 1.25f * (light.Le[c] - gray), 1e-6);
    }
}

TEST(LightFilters, LeaveEveryLightSomethingToBeChosenBy) {
    for (const float tint : {0.0f, 0.5f, 8.0f}) {
        const scene::Light plain = light_of(LightKind::Rect);
        const Lit filtered(with(plain, {tinted(Rgb(tint))})), bare(plain);
        const double ratio = filtered.lights.power(0, 1.0) / bare.lights.power(0, 1.0);
        EXPECT_TRUE(filtered.lights.is_on(0));
        EXPECT_NEAR(ratio, std::max(double(tint), 1e-3), 1e-6);
        EXPECT_NEAR(filtered.lights.bounds(0).cone.intensity,
                    ratio * bare.lights.bounds(0).cone.intensity, 1e-6 * ratio);
    }
    // Doors may open to any side: the bounds are those of the light
    scene::BarnDoorFilter doors;
    const Lit filtered(with(light_of(LightKind::Rect), {filter_of(doors)}));
    const Lit bare(light_of(LightKind::Rect));
    EXPECT_EQ(filtered.lights.power(0, 1.0), bare.lights.power(0, 1.0));
}

TEST(LightFilters, WithoutTheirTextureAreLeftOut) {
    scene::GoboFilter gobo;
    gobo.texture_file = "missing.exr";
    const scene::Scene scene = scene_of({with(light_of(LightKind::Rect), {filter_of(gobo)})});
    Diagnostics diagnostics;
    const LightSet lights(
        scene,
        [](const scene::Light&) {
            return Result<EnvironmentImage>(Error{"file-not-found", "no such file"});
        },
        diagnostics);
    EXPECT_EQ(diagnostics.all().size(), 1u);
    EXPECT_EQ(lights.unread_textures(), 1u);
    EXPECT_FALSE(lights.is_filtered(0));
    EXPECT_EQ(lights.sample(0, {0, 0, -1}, Vec2(0.5f))->Le, Rgb(1.0f));
}

}  // namespace
}  // namespace velatura::lights
