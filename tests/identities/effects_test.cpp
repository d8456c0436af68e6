// SPDX-License-Identifier: Apache-2.0
// What renders of these stages do: nothing that the plan has off, and the same image when it is
// made to run.
#include "effect_fixtures.h"
#include "effect_plans.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace velatura::test {
namespace {

using integrator::EffectPlan;
using integrator::EffectState;
using scene::Effect;

constexpr integrator::RenderOptions few_samples = {.seed = 3, .end_sample = 4};

/// Images are not there: what reads them gives its fallback, which is another thing to test.
bool wants_an_image(const EffectFixture& f) {
    return f.effect == Effect::EnvironmentMaps || f.effect == Effect::LightTextures;
}

/// Counters move for what is called for, and for nothing else.
TEST(Effects, RunWhenTheyAreCalledForAndElseNot) {
    for (const EffectFixture& fixture : effect_fixtures()) {
        if (wants_an_image(fixture)) continue;
        const scene::Scene scene =
            scene_from_usda(fixture_usda(fixture, fixture.on, Arrival::Direct), 16, 12);
        const EffectPlan plan = integrator::make_plan(scene, plan_of_test());
        integrator::RayCounts counts;
        render_scene(scene, few_samples, RenderSetup{.counts = &counts});
        EXPECT_GT(counts.effects.of(fixture.effect), 0u)
            << scene::info(fixture.effect).name << " by " << fixture.name;
        EXPECT_EQ(names_of(integrator::broken_promises(plan, counts.effects)), "")
            << "with " << scene::info(fixture.effect).name;
    }
}

TEST(Effects, DoNotRunWhereTheyAreProvenZeroOrLeftOut) {
    for (const EffectFixture& fixture : effect_fixtures()) {
        if (wants_an_image(fixture)) continue;
        std::vector<scene::Scene> scenes;
        if (!fixture.neutral.empty())
            scenes.push_back(
                scene_from_usda(fixture_usda(fixture, fixture.neutral, Arrival::Direct), 16, 12));
        if (integrator::can_omit(fixture.effect)) {
            scenes.push_back(
                scene_from_usda(fixture_usda(fixture, fixture.on, Arrival::Direct), 16, 12));
            integrator::omit(scenes.back(), fixture.effect);
        }
        for (const scene::Scene& scene : scenes) {
            integrator::RayCounts counts;
            render_scene(scene, few_samples, RenderSetup{.counts = &counts});
            EXPECT_EQ(counts.effects.of(fixture.effect), 0u)
                << scene::info(fixture.effect).name << " by " << fixture.name;
        }
    }
}

/// A camera before a box on a floor, and these prims.
std::string stage_with(const std::string& prims) {
    return "#usda 1.0\ndef Camera \"Cam\" {\n double3 xformOp:translate = (0, 1, 6)\n uniform "
           "token[] xformOpOrder = [\"xformOp:translate\"]\n}\n"
           "def Cube \"Box\" {\n double size = 2\n}\ndef Cube \"Floor\" {\n double size = 4\n "
           "double3 xformOp:translate = (0, -3, 0)\n uniform token[] xformOpOrder = "
           "[\"xformOp:translate\"]\n}\n" +
           prims;
}

/// Lights that are dark, or the only one, in each way of choosing lights.
TEST(Effects, OfLightsThatAreDarkOrAloneDoNotRun) {
    const std::string lamp =
        "def SphereLight \"Lamp\" {\n float inputs:intensity = 9\n double3 xformOp:translate = (0, "
        "4, 4)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    const std::string dark = lamp + "}\ndef SphereLight \"Dark\" {\n float inputs:intensity = 0\n";
    const std::string dark_mesh =
        lamp +
        "}\ndef Cube \"DarkCube\" (prepend apiSchemas = [\"MeshLightAPI\"]) {\n double size = 3\n "
        "float inputs:intensity = 0\n";
    const std::string some =
        " uniform bool collection:lightLink:includeRoot = 0\n rel collection:lightLink:includes = "
        "</Box>\n";
    const std::string multiplied = " float inputs:diffuse = 0.5\n float inputs:specular = 0.2\n";
    for (const std::string& lights : {lamp, lamp + some, dark, dark + multiplied, dark + some,
                                      dark_mesh, dark_mesh + multiplied + some}) {
        const scene::Scene scene = scene_from_usda(stage_with(lights + "}\n"), 16, 12);
        const EffectPlan plan = integrator::make_plan(scene, plan_of_test());
        for (const auto selection : {lights::SelectionKind::Uniform, lights::SelectionKind::Power,
                                     lights::SelectionKind::Tree}) {
            integrator::RayCounts counts;
            render_scene(scene, few_samples,
                         RenderSetup{.counts = &counts, .light_selection = selection});
            EXPECT_EQ(names_of(integrator::broken_promises(plan, counts.effects)), "")
                << lights << "selection " << int(selection);
        }
    }
}

/// Any plan that is wrong is found out by the counters: here one that has everything off.
TEST(Effects, ThatRunAgainstThePlanAreFoundOut) {
    const scene::Scene scene = scene_from_usda(room_usda());
    integrator::RayCounts counts;
    render_scene(scene, few_samples, RenderSetup{.counts = &counts});
    const std::vector<Effect> broken = integrator::broken_promises(EffectPlan{}, counts.effects);
    for (const Effect e :
         {Effect::Quadrics, Effect::Transmission, Effect::Clearcoat, Effect::Environment,
          Effect::LightSelection, Effect::SurfaceEmission, Effect::VaryingColors})
        EXPECT_NE(std::find(broken.begin(), broken.end(), e), broken.end()) << scene::info(e).name;
    EXPECT_EQ(names_of(integrator::broken_promises(integrator::make_plan(scene, plan_of_test()),
                                                   counts.effects)),
              "");
}

scene::EffectSet forced_in(const scene::Scene& scene) {
    integrator::PlanOptions options = plan_of_test();
    options.force_all = true;
    return integrator::make_plan(scene, options).forced();
}

uint64_t image(const scene::Scene& scene, const scene::EffectSet& forced) {
    return fingerprint(render_scene(scene, few_samples, RenderSetup{.forced = forced}));
}

/// All that can run without being called for does, in every stage with one effect, and no bit of
/// any layer is another.
TEST(Effects, ThatNothingCallsForChangeNoBit) {
    int scenes = 0;
    for (const EffectFixture& fixture : effect_fixtures()) {
        if (wants_an_image(fixture)) continue;
        const scene::Scene scene =
            scene_from_usda(fixture_usda(fixture, fixture.on, Arrival::Instance), 16, 12);
        const scene::EffectSet forced = forced_in(scene);
        EXPECT_FALSE(forced.is_empty());
        EXPECT_EQ(image(scene, {}), image(scene, forced))
            << scene::info(fixture.effect).name << " by " << fixture.name;
        ++scenes;
    }
    const scene::Scene room = scene_from_usda(room_usda());
    EXPECT_EQ(image(room, {}), image(room, forced_in(room)));
    EXPECT_GE(scenes, 12);
}

/// Stages with several effects at once: every two of the fixtures meet somewhere. Surfaces take one
/// set of inputs each, so the fixtures of a stage stand side by side.
TEST(Effects, ChangeNoBitInCompany) {
    std::vector<EffectFixture> all;
    for (const EffectFixture& fixture : effect_fixtures())
        if (!wants_an_image(fixture) && !fixture.stays_at_home) all.push_back(fixture);
    std::vector<std::vector<bool>> met(all.size(), std::vector<bool>(all.size(), false));
    std::mt19937 random(3);
    constexpr int stages = 12;
    for (int stage = 0; stage < stages; ++stage) {
        std::vector<size_t> chosen;
        for (size_t i = 0; i < all.size(); ++i)
            if (random() % 8 < 5) chosen.push_back(i);
        // Prims of all of them below one parent each
        EffectFixture joint = all[chosen[0]];
        std::string prims;
        for (const size_t i : chosen) {
            for (const size_t k : chosen) met[i][k] = true;
            const std::string path = fmt::format("/World/F{}", i);
            prims += fmt::format(
                "\ndef Xform \"F{}\" {{ double3 xformOp:translate = ({}, 0, {})\n uniform token[] "
                "xformOpOrder = [\"xformOp:translate\"]\n{}\n }}",
                i, int(i % 5) - 2, -int(i % 3), fixture_prims(all[i], all[i].on, path));
        }
        joint.is_prim = true;
        const scene::Scene scene =
            scene_from_usda(fixture_usda(joint, prims, Arrival::Direct), 16, 12);
        integrator::RayCounts counts;
        const uint64_t plain =
            fingerprint(render_scene(scene, few_samples, RenderSetup{.counts = &counts}));
        EXPECT_EQ(plain, image(scene, forced_in(scene))) << "stage " << stage;
        EXPECT_EQ(names_of(integrator::broken_promises(integrator::make_plan(scene, plan_of_test()),
                                                       counts.effects)),
                  "");
    }
    size_t pairs = 0, wanted = 0;
    for (size_t i = 0; i < all.size(); ++i)
        for (size_t k = 0; k < i; ++k, ++wanted) pairs += met[i][k];
    std::printf("%zu of %zu pairs met in %d stages\n", pairs, wanted, stages);
    EXPECT_GE(double(pairs), 0.98 * double(wanted));
}

}  // namespace
}  // namespace velatura::test
