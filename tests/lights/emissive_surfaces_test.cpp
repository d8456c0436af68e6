// SPDX-License-Identifier: Apache-2.0
#include "emissive_fixtures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace velatura::lights {
namespace {

const Mat4 sheared(
    1.5f, 0.25f, 0, 0, -0.5f, 0.75f, 0.125f, 0, 0.25f, 0.5f, 1, 0, 0.5f, -0.25f, 2, 1);
const Mat4 mirrored(-1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, -2, 1, 3, 1);

/// Two triangles placed directly, a prototype of three placed twice, and dark geometry between.
void fill(EmissiveStage& stage) {
    const auto dark = stage.add_material(Rgb(0.0f)), warm = stage.add_material(Rgb(3, 2, 1));
    const auto blue = stage.add_material(Rgb(0, 0, 4));
    stage.scene.shapes.push_back(
        EmissiveStage::triangles({{-5, -5, 6}, {5, -5, 6}, {0, 5, 6}}, dark));
    stage.scene.shapes.push_back(EmissiveStage::triangles(
        {{-1, -1, 2}, {1, -1, 2}, {0.5f, 1, 3}, {3, 0, 1}, {4, 0, 1.5f}, {3, 1, 2}}, warm));
    scene::Shape mixed = EmissiveStage::triangles({{0, 0, 0},
                                                   {1, 0, 0},
                                                   {0, 1, 0},
                                                   {2, 0, 0},
                                                   {2.5f, 0, 0},
                                                   {2, 0.5f, 1},
                                                   {0, 0, -1},
                                                   {0, 1, -1},
                                                   {1, 0, -1}},
                                                  dark);
    std::get<scene::Mesh>(mixed.geometry).face_materials = {blue, dark, warm};
    stage.scene.prototypes.push_back({"/Proto", {mixed}});
    stage.add_instance(0, sheared);
    stage.add_instance(0, mirrored);
}

TEST(EmissiveSurfaces, ListsWhatEmitsAndNothingElse) {
    EmissiveStage stage;
    fill(stage);
    const LightSet& lights = stage.prepare();
    ASSERT_EQ(lights.item_count(), 4u);
    EXPECT_EQ(stage.all().size(), 6u);
    EXPECT_EQ(lights.surfaces()->group_count(), 1u) << "instances of a prototype share";
    for (const LightId id : stage.all()) {
        EXPECT_TRUE(lights.is_on(id));
        EXPECT_EQ(lights.group(id), stage.scene.emissive_group());
    }
    // From a surface point to its light and back
    int found = 0;
    for (uint32_t instance : {scene::none, 0u, 1u}) {
        const bool is_direct = instance == scene::none;
        for (uint32_t shape = 0; shape < (is_direct ? 2u : 1u); ++shape) {
            for (uint32_t triangle = 0; triangle < (is_direct ? shape + 1 : 3u); ++triangle) {
                const geometry::Hit hit{1, 0.25f, 0.25f, instance, shape, triangle};
                const auto point =
                    geometry::make_surface_point(stage.scene, *stage.geometry, {}, hit);
                const auto id = lights.find_surface(point);
                EXPECT_EQ(id.has_value(), stage.materials->is_emissive(point.material));
                if (!id) continue;
                ++found;
                const Vec3 above = point.p + point.ng;
                const auto seen = lights.intersect(*id, above, -point.ng);
                ASSERT_TRUE(seen);
                EXPECT_NEAR(seen->t, 1.0f, 1e-5f);
                EXPECT_EQ(seen->Le, stage.materials->emission(point, point.ng, 0.0f));
            }
        }
    }
    EXPECT_EQ(found, 6);
}

TEST(EmissiveSurfaces, SamplesAreFoundAgainByRaysWithTheSameNumbers) {
    EmissiveStage stage;
    fill(stage);
    const LightSet& lights = stage.prepare();
    for (const LightId id : stage.all()) {
        for (const Vec3& p :
             {Vec3(0, -0.1f, 0), Vec3(0.9f, -0.6f, 2.5f), Vec3(-300, 20, 5), Vec3(0, 99, 5e4f)}) {
            int samples = 0, lost = 0;
            for (int k = 0; k < 1024; ++k) {
                const sampling::PixelSampler sampler(1, 2, 3, uint64_t(k));
                const auto s =
                    lights.sample(id, p, sampler.get_2d(0, sampling::Purpose::LightSurface));
                if (!s) continue;
                ++samples;
                EXPECT_TRUE(s->is_surface && !s->is_delta);
                EXPECT_NEAR(s->wi.length(), 1.0f, 1e-6f);
                // The target lies on the side of p, closer than rounding can tell from the sample
                const Vec3 q = p + s->wi * s->distance;
                EXPECT_LE((s->target - q).length(),
                          1e-6f * s->distance + 1e-6f * (p.length() + q.length()));
                EXPECT_NEAR(lights.surface_pdf(id, p, q), s->pdf, 1e-4f * s->pdf);
                const auto hit = lights.intersect(id, p, s->wi);
                if (!hit) {
                    ++lost;
                    continue;
                }
                EXPECT_EQ(hit->Le, s->Le);
                EXPECT_NEAR(hit->pdf, s->pdf, 1e-3f * s->pdf);
                EXPECT_NEAR(hit->t, s->distance, 1e-3f * s->distance);
            }
            EXPECT_GT(samples, 1000);
            // Rounded directions miss a triangle only along its edges, more often the smaller it
            // looks
            EXPECT_LE(lost, p.length() > 1e4f ? samples / 10 : samples / 100);
        }
    }
}

TEST(EmissiveSurfaces, PointsOfTheirOwnPlaneDoNotSeeTriangles) {
    // A plane that no axis is parallel to: rounding puts half of its points above it, half below,
    // from where the triangle would fill half the sphere
    EmissiveStage stage;
    const auto glow = stage.add_material(Rgb(1.0f));
    stage.scene.shapes.push_back(
        EmissiveStage::triangles({{1, 0.3f, -0.7f}, {4, 1.1f, 0.9f}, {2, 3.7f, 2.3f}}, glow));
    stage.scene.prototypes.push_back({"/Proto", stage.scene.shapes});
    stage.add_instance(0, sheared);
    const LightSet& lights = stage.prepare();
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0.01f, 0.49f);
    int blind = 0;
    for (int i = 0; i < 2000; ++i) {
        geometry::Hit hit{1, unit(random), unit(random), i % 2 ? 0u : scene::none, 0, 0};
        const auto point = geometry::make_surface_point(stage.scene, *stage.geometry, {}, hit);
        const LightId id = *lights.find_surface(point);
        EXPECT_FALSE(lights.sample(id, point.p, {unit(random), unit(random)}));
        EXPECT_EQ(lights.surface_pdf(id, point.p, point.p + point.ns), 0.0f);
        blind += 1;
        // From a millionth of its size away it fills half the sphere
        const Vec3 beside = point.p + point.ng * 1e-5f;
        const auto seen = lights.sample(id, beside, {0.5f, 0.5f});
        ASSERT_TRUE(seen);
        EXPECT_NEAR(double(seen->pdf), 1.0 / (2.0 * pi_d), 1e-3);
    }
    EXPECT_EQ(blind, 2000);
}

TEST(EmissiveSurfaces, IrradianceIsSteadyAcrossTheSwitchToAreaSampling) {
    // E = ∫ cosθ dω of a far triangle is Ω cosθ, from solid angles of 1e-4 down to 1e-9
    for (double d = 60.0; d < 3e4; d *= 1.25) {
        EmissiveStage stage;
        const auto glow = stage.add_material(Rgb(1.0f));
        const float z = float(d);
        stage.scene.shapes.push_back(
            EmissiveStage::triangles({{0, 0, z}, {1, 0, z}, {0, 1, z}}, glow));
        const LightSet& lights = stage.prepare();
        const Estimate e = irradiance(lights, Vec3(0.0f), Vec3(0, 0, 1), 256);
        // Exact to second order: mean of 1 / (1 + r²/d²)² over the triangle, mean r² = 1/3
        const double expected =
            0.5 / (double(z) * double(z)) * (1.0 - 2.0 / (3.0 * double(z) * double(z)));
        EXPECT_NEAR(e.mean, expected, 2e-5 * expected) << d;
        EXPECT_LE(e.standard_error, 2e-5 * expected);
    }
}

TEST(EmissiveSurfaces, PowerIsThatOfBothSides) {
    EmissiveStage stage;
    fill(stage);
    const LightSet& lights = stage.prepare();
    const double warm = double(luminance(Rgb(3, 2, 1)));
    // Area of the first triangle: base 2, height sqrt(5)
    EXPECT_NEAR(lights.power(0, 1.0), 2.0 * pi_d * std::sqrt(5.0) * warm, 1e-5);
    // The mirrored instance keeps areas: 1/2 of each material
    const double blue = double(luminance(Rgb(0, 0, 4)));
    EXPECT_NEAR(lights.power(3, 1.0), 2.0 * pi_d * 0.5 * (warm + blue), 1e-5);
}

TEST(EmissiveSurfaces, InstancesShareTrianglesUnlessTheyShineDifferently) {
    EmissiveStage stage;
    const auto dark = stage.add_material(Rgb(0.0f)), glow = stage.add_material(Rgb(1.0f));
    std::vector<Vec3> points;
    for (int i = 0; i < 500; ++i)
        for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)})
            points.push_back(v + Vec3(float(i), 0, 0));
    stage.scene.prototypes.push_back({"/Proto", {EmissiveStage::triangles(points, glow)}});
    for (int i = 0; i < 3000; ++i)
        stage.add_instance(0, Mat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, float(i), 0, 1));
    stage.scene.instances[7].material_override = dark;
    stage.scene.instances[8].material_override = glow;
    const scene::PrimvarId color = scene::intern_primvar(stage.scene, scene::display_color_primvar);
    // This material does not read it
    scene::set_value(stage.scene, stage.scene.instances[9], {color, 3, false, {1, 0, 0, 0}});
    const LightSet& lights = stage.prepare();
    EXPECT_EQ(lights.item_count(), 2999u);
    EXPECT_EQ(lights.surfaces()->group_count(), 2u) << "with and without override";
    const geometry::Hit hit{1, 0.25f, 0.25f, 7, 0, 3};
    EXPECT_FALSE(
        lights.find_surface(geometry::make_surface_point(stage.scene, *stage.geometry, {}, hit)));

    // Emission by displayColor: one group per color, and the instance with an override
    const auto colored = stage.add_material(Rgb(0.0f));
    scene::Input& emission = stage.scene.materials[colored].emissive_color;
    emission.source = scene::Input::Source::Primvar;
    emission.primvar = color;
    stage.scene.prototypes[0].shapes[0].material = colored;
    for (uint32_t i = 0; i < stage.scene.instances.size(); ++i) {
        const Rgb value = i % 3 ? Rgb(0, float(i % 3), 0) : Rgb(4.0f);
        scene::set_value(stage.scene, stage.scene.instances[i],
                         {color, 3, false, {value.x, value.y, value.z, 0}});
    }
    const LightSet& by_color = stage.prepare();
    EXPECT_EQ(by_color.surfaces()->group_count(), 4u);
    EXPECT_NEAR(by_color.power(0, 1.0) / by_color.power(1, 1.0), 4.0 / 0.7152, 1e-4);
    EXPECT_EQ(by_color.sample(LightId(0, 2), Vec3(0, 0, 5), {0.5f, 0.5f})->Le, Rgb(4.0f));
}

TEST(EmissiveSurfaces, TrianglesThatLookBlackKeepASmallChance) {
    // Emission from a primvar that is black but for one triangle in ten: the others are lifted to
    // a share of two hundredths
    EmissiveStage stage;
    const auto glow = stage.add_material(Rgb(0.0f));
    scene::Input& emission = stage.scene.materials[glow].emissive_color;
    emission.source = scene::Input::Source::Primvar;
    emission.primvar = scene::intern_primvar(stage.scene, "glow");
    std::vector<Vec3> points;
    scene::Primvar primvar;
    primvar.name = emission.primvar;
    primvar.interpolation = scene::Interpolation::Uniform;
    primvar.width = 3;
    for (int i = 0; i < 50; ++i) {
        const float x = float(i);
        points.insert(points.end(), {{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}});
        for (int c = 0; c < 3; ++c) primvar.values.push_back(i % 10 == 3 ? 5.0f : 0.0f);
    }
    scene::Shape shape = EmissiveStage::triangles(points, glow);
    std::get<scene::Mesh>(shape.geometry).primvars = {primvar};
    stage.scene.shapes = {shape};
    const LightSet& lights = stage.prepare();
    ASSERT_EQ(lights.item_count(), 50u);
    double bright = 0, dark = 0;
    for (uint32_t i = 0; i < 50; ++i) {
        EXPECT_TRUE(lights.is_on(i));
        (i % 10 == 3 ? bright : dark) += lights.power(i, 1.0);
    }
    EXPECT_NEAR(bright, 5 * pi_d * 5.0, 1e-4);
    EXPECT_GT(dark, 0.01 * bright);
    EXPECT_LT(dark, 0.02 * bright);
}

Receiver random_receiver(std::mt19937& random) {
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    Receiver at{Vec3(4 * unit(random), 4 * unit(random), 4 * unit(random))};
    const Vec3 n(unit(random), unit(random), unit(random));
    if (random() % 3 != 0) at.n = normalize(n);
    at.both_sides = random() % 2 == 0;
    return at;
}

TEST(EmissiveSurfaces, SelectionsOfEveryKindSumToOneAndMatchTheirChoices) {
    EmissiveStage stage;
    fill(stage);
    for (int i = 0; i < 30; ++i) {
        const float x = float(i);
        stage.add_instance(0,
                           Mat4(0.5f, 0, 0, 0, 0, 0.7f, 0, 0, 0, 0, 0.5f, 0, x - 15, 2, -x / 3, 1));
    }
    stage.scene.lights = {light_of(scene::LightKind::Sphere, translation(0, 1, 4)),
                          light_of(scene::LightKind::Dome)};
    const LightSet& lights = stage.prepare();
    const std::vector<LightId> all = stage.all();
    ASSERT_EQ(all.size(), 2u + 2u + 32u * 2u);
    for (const SelectionKind kind :
         {SelectionKind::Uniform, SelectionKind::Power, SelectionKind::Area, SelectionKind::Tree}) {
        const auto selector = make_light_selector(lights, Box3(Vec3(-20.0f), Vec3(20.0f)), {kind});
        std::mt19937 random(3);
        for (int round = 0; round < 30; ++round) {
            const Receiver at = random_receiver(random);
            double sum = 0;
            for (const LightId id : all) sum += double(selector->pmf(at, id));
            constexpr int steps = 4096;
            int none = 0;
            for (int i = 0; i < steps; ++i) {
                const auto choice = selector->select(at, (i + 0.5) / steps);
                none += !choice;
                if (!choice) continue;
                ASSERT_EQ(choice->pmf, selector->pmf(at, choice->light));
            }
            EXPECT_LE(sum, 1.0 + 1e-5);
            EXPECT_NEAR(sum, 1.0 - double(none) / steps, 8.0 / steps);
            EXPECT_TRUE(kind == SelectionKind::Tree || std::abs(sum - 1.0) < 1e-5);
            // What has no chance brings nothing
            for (const LightId id : all) {
                if (selector->pmf(at, id) > 0.0f) continue;
                for (int k = 0; k < 9; ++k) {
                    const auto s = lights.sample(
                        id, at.p, Vec2(float(k % 3) / 3 + 0.1f, float(k / 3) / 3 + 0.1f));
                    if (!s || at.n == Vec3(0.0f)) {
                        EXPECT_FALSE(s);
                        continue;
                    }
                    const float cosine = at.n.dot(s->wi);
                    EXPECT_LE(at.both_sides ? std::abs(cosine) : cosine, 0.0f);
                }
            }
        }
    }
}

TEST(EmissiveSurfaces, ScalingByAPowerOfTwoChangesNothingButDistances) {
    const auto scaled_stage = [](float factor) {
        auto stage = std::make_unique<EmissiveStage>();
        fill(*stage);
        for (scene::Shape& shape : stage->scene.shapes)
            for (Vec3& p : std::get<scene::Mesh>(shape.geometry).points) p *= factor;
        for (scene::Instance& instance : stage->scene.instances)
            for (int i = 0; i < 4; ++i)
                for (int k = 0; k < 3; ++k) instance.render_from_prototype[i][k] *= factor;
        stage->prepare();
        return stage;
    };
    const auto stage = scaled_stage(1.0f);
    for (const int exponent : {-20, -7, 1, 20}) {
        const float factor = std::ldexp(1.0f, exponent);
        const auto other = scaled_stage(factor);
        for (const SelectionKind kind : {SelectionKind::Power, SelectionKind::Tree}) {
            const Box3 box(Vec3(-4.0f), Vec3(4.0f));
            const auto a = make_light_selector(*stage->lights, box, {kind});
            const auto b = make_light_selector(*other->lights,
                                               Box3(box.min * factor, box.max * factor), {kind});
            std::mt19937 random(5);
            for (int round = 0; round < 20; ++round) {
                const Receiver at = random_receiver(random);
                Receiver there = at;
                there.p *= factor;
                for (const LightId id : stage->all()) {
                    ASSERT_EQ(a->pmf(at, id), b->pmf(there, id));
                    const Vec2 u(0.3f, 0.8f);
                    const auto s = stage->lights->sample(id, at.p, u);
                    const auto t = other->lights->sample(id, there.p, u);
                    ASSERT_EQ(s.has_value(), t.has_value());
                    if (!s) continue;
                    EXPECT_EQ(s->wi, t->wi);
                    EXPECT_EQ(s->pdf, t->pdf);
                    EXPECT_EQ(s->target * factor, t->target);
                }
            }
        }
    }
}

}  // namespace
}  // namespace velatura::lights
