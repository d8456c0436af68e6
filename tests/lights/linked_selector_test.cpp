// SPDX-License-Identifier: Apache-2.0
// Choosing among lights of which some shine on some geometry only.
#include "lights/linked_selector.h"

#include "emissive_fixtures.h"
#include "light_fixtures.h"
#include "lights/light_tree.h"

#include <gtest/gtest.h>

namespace velatura::lights {
namespace {

using scene::LinkClass;

constexpr SelectionKind kinds[] = {SelectionKind::Uniform, SelectionKind::Power,
                                   SelectionKind::Area, SelectionKind::Tree};
constexpr LinkClass class_count = 4;

/// Lamps in a row and a dome; lamp i shines on class c where bit i mod 8 of `pattern[c]` is set.
constexpr uint32_t pattern[class_count] = {0xff, 0x0f, 0x0f, 0x00};

scene::Scene linked_scene(uint32_t lamps) {
    std::vector<scene::Light> all;
    for (uint32_t i = 0; i < lamps; ++i) {
        scene::Light light = light_of(scene::LightKind::Sphere, translation(double(i), 0, 3));
        light.radius = 0.1f;
        light.Le = Rgb(1.0f + float(i % 5));
        light.links.lit = i % 8;
        all.push_back(light);
    }
    all.push_back(light_of(scene::LightKind::Dome));
    scene::Scene scene = scene_of(all);
    scene.linking.class_count = class_count;
    for (uint32_t bit = 0; bit < 8; ++bit) {
        scene::LinkSet set(class_count);
        for (LinkClass c = 0; c < class_count; ++c)
            if ((pattern[c] >> bit & 1) != 0) set.add(c);
        scene.linking.sets.push_back(set);
    }
    return scene;
}

Receiver receiver_of(LinkClass c) {
    return {.p = Vec3(2.0f, 0, 0), .n = Vec3(0, 0, 1), .link = c};
}

TEST(LinkedSelector, ChoosesAmongTheLightsThatShineOnTheGeometry) {
    for (const uint32_t lamps : {3u, 200u}) {
        const scene::Scene scene = linked_scene(lamps);
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics);
        for (const SelectionKind kind : kinds) {
            const auto selector =
                make_light_selector(lights, Box3(Vec3(-1.0f), Vec3(1.0f)), {.kind = kind});
            for (LinkClass c = 0; c < class_count; ++c) {
                const Receiver at = receiver_of(c);
                double sum = 0.0;
                for (uint32_t i = 0; i < lights.size(); ++i) {
                    const double pmf = double(selector->pmf(at, i));
                    EXPECT_EQ(pmf > 0.0, lights.illuminates(i, c)) << int(kind) << ' ' << i;
                    sum += pmf;
                }
                EXPECT_NEAR(sum, 1.0, 1e-5) << int(kind) << ' ' << c;
                for (int i = 0; i < 4096; ++i) {
                    const auto choice = selector->select(at, double(i) / 4096.0);
                    ASSERT_TRUE(choice);
                    EXPECT_EQ(choice->pmf, selector->pmf(at, choice->light));
                }
            }
        }
    }
}

TEST(LinkedSelector, IsThatOfASceneWithoutTheOtherLights) {
    const scene::Scene scene = linked_scene(40);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (const SelectionKind kind : kinds) {
        const auto selector = make_light_selector(lights, Box3(), {.kind = kind});
        for (LinkClass c = 0; c < class_count; ++c) {
            scene::Scene left = scene_of({});
            std::vector<uint32_t> number;
            for (uint32_t i = 0; i < lights.size(); ++i) {
                if (!lights.illuminates(i, c)) continue;
                left.lights.push_back(scene.lights[i]);
                left.lights.back().links = {};
                number.push_back(i);
            }
            const LightSet alone(left, {}, diagnostics);
            const auto reference = make_light_selector(alone, Box3(), {.kind = kind});
            for (uint32_t i = 0; i < alone.size(); ++i)
                EXPECT_EQ(selector->pmf(receiver_of(c), number[i]),
                          reference->pmf(receiver_of(0), i));
        }
    }
}

TEST(LinkedSelector, SharesASelectorWhereTheSameLightsShineAndWhereThereIsNoRoom) {
    const scene::Scene scene = linked_scene(8);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const auto make = [&](const std::vector<bool>* among) {
        return std::make_unique<LightTree>(lights, among);
    };
    // All lights, the first four, none of the lamps
    EXPECT_EQ(LinkedSelector(lights, make).selector_count(), 3u);
    const LinkedSelector cramped(lights, make, 2 * lights.item_count());
    EXPECT_EQ(cramped.selector_count(), 2u);
    for (uint32_t i = 0; i < lights.size(); ++i)
        EXPECT_EQ(cramped.pmf(receiver_of(3), i), cramped.pmf(receiver_of(0), i));
}

TEST(LinkedSelector, KnowsTheLinksOfGeometryThatIsALight) {
    EmissiveStage stage;
    const scene::MaterialId glow = stage.add_material(Rgb(1.0f));
    stage.scene.linking.class_count = 2;
    scene::LinkSet first(2);
    first.add(0);
    stage.scene.linking.sets = {first};
    for (int i = 0; i < 2; ++i) {
        scene::Shape shape = EmissiveStage::triangles(
            {Vec3(float(i), 0, 2), Vec3(float(i) + 1, 0, 2), Vec3(float(i), 1, 2)}, glow);
        scene::MeshLight light;
        light.group = 0;
        if (i == 1) light.links.lit = 0;
        shape.light = scene::MeshLightId(stage.scene.mesh_lights.size());
        stage.scene.mesh_lights.push_back(light);
        stage.scene.shapes.push_back(shape);
    }
    // The same two once more, as parts of one instance
    stage.scene.prototypes.push_back({"/P", stage.scene.shapes});
    scene::Instance instance;
    instance.render_from_prototype[3][1] = 2.0f;
    stage.scene.instances.push_back(instance);
    stage.prepare();
    for (const SelectionKind kind : kinds) {
        const auto selector = make_light_selector(*stage.lights, Box3(Vec3(-1), Vec3(3)), {kind});
        for (const LinkClass c : {0u, 1u}) {
            const Receiver at{.p = Vec3(0.5f, 0.5f, 0), .link = c};
            EXPECT_GT(selector->pmf(at, 0), 0.0f);
            EXPECT_EQ(selector->pmf(at, 1) > 0.0f, c == 0);
            EXPECT_GT(selector->pmf(at, LightId(2, 0)), 0.0f);
            EXPECT_EQ(stage.lights->illuminates(LightId(2, 0), c), true);
            EXPECT_EQ(stage.lights->illuminates(LightId(2, 1), c), c == 0);
        }
    }
}

}  // namespace
}  // namespace velatura::lights
