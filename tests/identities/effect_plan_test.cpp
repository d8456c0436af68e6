// SPDX-License-Identifier: Apache-2.0
// What the plan says of stages that differ in one effect, however it gets into them.
#include "integrator/effect_plan.h"

#include "effect_fixtures.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

namespace velatura::test {
namespace {

using integrator::EffectPlan;
using integrator::EffectState;
using scene::Effect;

integrator::PlanOptions usual_options() {
    integrator::PlanOptions options;
    options.layers.groups = {{"key", {}, false}};
    return options;
}

EffectPlan plan_of(const EffectFixture& fixture, std::string_view content, Arrival arrival) {
    return integrator::make_plan(scene_from_usda(fixture_usda(fixture, content, arrival)),
                                 usual_options());
}

bool is_applicable(const EffectFixture& fixture, Arrival arrival) {
    const bool is_instanced = arrival == Arrival::Instance || arrival == Arrival::NestedInstance ||
                              arrival == Arrival::PointInstance;
    return !(fixture.stays_at_home && is_instanced);
}

/// Each fixture in each way of arriving: what is called for is on, with a prim or a reason.
TEST(EffectPlan, SeesWhatASceneCallsFor) {
    int flips = 0;
    for (const EffectFixture& fixture : effect_fixtures()) {
        for (const Arrival arrival : arrivals) {
            if (!is_applicable(fixture, arrival)) continue;
            const EffectPlan plan = plan_of(fixture, fixture.on, arrival);
            const integrator::EffectEntry& entry = plan.of(fixture.effect);
            EXPECT_EQ(entry.state, EffectState::On) << scene::info(fixture.effect).name << " by "
                                                    << fixture.name << ", " << name_of(arrival);
            EXPECT_FALSE(entry.prim.empty() && entry.why.empty());
            EXPECT_GE(entry.prims, 1u);
            ++flips;
        }
    }
    std::printf("%d flips\n", flips);
    EXPECT_GE(flips, 200);
}

/// The same with the effect authored away: off, and proven zero where something was authored.
TEST(EffectPlan, ProvesWhatChangesNothing) {
    int prunes = 0, off = 0;
    for (const EffectFixture& fixture : effect_fixtures()) {
        for (const Arrival arrival : arrivals) {
            if (fixture.neutral.empty() || !is_applicable(fixture, arrival)) continue;
            const integrator::EffectEntry entry =
                plan_of(fixture, fixture.neutral, arrival).of(fixture.effect);
            ++prunes;
            off += entry.state != EffectState::On;
            EXPECT_NE(entry.state, EffectState::On)
                << scene::info(fixture.effect).name << " by " << fixture.name << ", "
                << name_of(arrival) << ": " << entry.why;
        }
    }
    std::printf("%d prunes, %d off\n", prunes, off);
    EXPECT_GE(prunes, 100);
}

TEST(EffectPlan, NamesThePrimThatAuthorsZero) {
    for (const EffectFixture& fixture : effect_fixtures()) {
        if (fixture.name != "constant") continue;
        const integrator::EffectEntry entry =
            plan_of(fixture, fixture.neutral, Arrival::Direct).of(fixture.effect);
        EXPECT_EQ(entry.state, EffectState::ProvenZero) << scene::info(fixture.effect).name;
        EXPECT_TRUE(entry.prim.starts_with("/World/Mat")) << entry.prim;
        EXPECT_FALSE(entry.why.empty());
    }
}

scene::Scene camera_scene(const std::string& camera, const std::string& more = "") {
    return scene_from_usda(
        "#usda 1.0\n(\n    startTimeCode = 0\n    endTimeCode = 2\n)\ndef Camera \"Cam\"\n{\n" +
        camera + "\n}\ndef Xform \"Turn\"\n{\n" + more +
        "\n    def Cube \"Box\" { double3 xformOp:translate = (0, 0, -9)\n uniform token[] "
        "xformOpOrder = [\"xformOp:translate\"]\n }\n}\n");
}

const std::string turning =
    "    float xformOp:rotateY.timeSamples = { 0: 0, 1: 30 }\n    uniform token[] xformOpOrder = "
    "[\"xformOp:rotateY\"]\n";
const std::string open_shutter = "    double shutter:open = 0\n    double shutter:close = 0.5\n";

TEST(EffectPlan, KnowsTheCamera) {
    const auto state = [](const scene::Scene& s, Effect e) {
        return integrator::make_plan(s, usual_options()).of(e).state;
    };
    EXPECT_EQ(state(camera_scene("float fStop = 2\nfloat focusDistance = 9"), Effect::DepthOfField),
              EffectState::On);
    EXPECT_EQ(state(camera_scene("float fStop = 0\nfloat focusDistance = 9"), Effect::DepthOfField),
              EffectState::ProvenZero);
    EXPECT_EQ(state(camera_scene(""), Effect::DepthOfField), EffectState::Absent);
    const std::string blades = "int velatura:lens:blades = 6\nfloat focusDistance = 9\n";
    EXPECT_EQ(state(camera_scene(blades + "float fStop = 2"), Effect::DepthOfField),
              EffectState::On);
    EXPECT_EQ(state(camera_scene(blades + "float fStop = 0"), Effect::DepthOfField),
              EffectState::ProvenZero);
    EXPECT_EQ(state(camera_scene(open_shutter + turning), Effect::CameraBlur), EffectState::On);
    EXPECT_EQ(state(camera_scene(open_shutter + "float2 velatura:shutter:curve = (0.25, 0.75)\n"),
                    Effect::CameraBlur),
              EffectState::Absent);
    EXPECT_EQ(state(camera_scene(open_shutter + "float motion:blurScale = 0\n" + turning),
                    Effect::CameraBlur),
              EffectState::ProvenZero);
    EXPECT_EQ(state(camera_scene(open_shutter), Effect::CameraBlur), EffectState::Absent);
    EXPECT_EQ(
        state(camera_scene("double shutter:open = 0.5\ndouble shutter:close = 0.5\n" + turning),
              Effect::CameraBlur),
        EffectState::ProvenZero);
}

std::string moving_mesh(const std::string& points) {
    return "def Mesh \"M\"\n{\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, "
           "2]\n uniform token subdivisionScheme = \"none\"\n point3f[] points.timeSamples = { " +
           points + " }\n}\n";
}

TEST(EffectPlan, KnowsWhatMoves) {
    const auto entry = [](const std::string& camera, const std::string& more) {
        return integrator::make_plan(camera_scene(camera, more), usual_options())
            .of(Effect::DeformationBlur);
    };
    const std::string first = "0: [(0, 0, -5), (1, 0, -5), (0, 1, -5)]",
                      later = ", 0.7: [(0, 0, -5), (1, 0, -5), (0, 2, -5)]",
                      same = ", 0.7: [(0, 0, -5), (1, 0, -5), (0, 1, -5)]";
    EXPECT_EQ(entry(open_shutter, moving_mesh(first + later)).state, EffectState::On);
    EXPECT_EQ(entry(open_shutter, moving_mesh(first + later)).prim, "/Turn/M");
    EXPECT_EQ(entry(open_shutter, moving_mesh(first + same)).state, EffectState::ProvenZero);
    EXPECT_EQ(entry("double shutter:close = 0\n", moving_mesh(first + later)).state,
              EffectState::ProvenZero);
    EXPECT_EQ(entry("", moving_mesh(first + later)).state, EffectState::Absent)
        << "no shutter was authored: nothing calls for blur";
}

/// What is taken out is not found again, and nothing else appears.
TEST(EffectPlan, LeavesOutWhatItCan) {
    int checked = 0;
    for (const EffectFixture& fixture : effect_fixtures()) {
        if (!integrator::can_omit(fixture.effect)) continue;
        scene::Scene scene = scene_from_usda(fixture_usda(fixture, fixture.on, Arrival::Direct));
        const EffectPlan before = integrator::make_plan(scene, usual_options());
        integrator::omit(scene, fixture.effect);
        const EffectPlan after = integrator::make_plan(scene, usual_options());
        EXPECT_NE(after.of(fixture.effect).state, EffectState::On)
            << scene::info(fixture.effect).name;
        for (size_t i = 0; i < scene::effect_count; ++i) {
            if (after.entries[i].state == EffectState::On) {
                EXPECT_EQ(before.entries[i].state, EffectState::On)
                    << scene::info(Effect(i)).name << " came with leaving out "
                    << scene::info(fixture.effect).name;
            }
        }
        ++checked;
    }
    EXPECT_GE(checked, 15);
}

/// A wall that is not thin any more does not begin to absorb, which the plan proved that it does
/// not.
TEST(EffectPlan, LeavesNoBodyBehindThinWalls) {
    const EffectFixture wall{Effect::ThinWalls, "with a depth",
                             "bool inputs:velatura:thinWalled = 1\nfloat inputs:opacity = "
                             "0.5\nfloat inputs:velatura:transmissionDepth = 1\ncolor3f "
                             "inputs:velatura:transmissionColor = (0.5, 0.7, 0.9)",
                             ""};
    scene::Scene scene = scene_from_usda(fixture_usda(wall, wall.on, Arrival::Direct));
    EXPECT_EQ(integrator::make_plan(scene, usual_options()).of(Effect::Absorption).state,
              EffectState::ProvenZero);
    integrator::omit(scene, Effect::ThinWalls);
    const EffectPlan after = integrator::make_plan(scene, usual_options());
    EXPECT_NE(after.of(Effect::ThinWalls).state, EffectState::On);
    EXPECT_NE(after.of(Effect::Absorption).state, EffectState::On);
}

TEST(EffectPlan, HasANameForEveryEffect) {
    for (size_t i = 0; i < scene::effect_count; ++i) {
        const std::string_view name = scene::info(Effect(i)).name;
        EXPECT_EQ(scene::find_effect(name), Effect(i));
        // What files hold is decided before the first sample; only some of it costs paths something
        const bool costs_paths =
            Effect(i) == Effect::ShadowLayers || Effect(i) == Effect::CasterLayers ||
            Effect(i) == Effect::ClampLayers || Effect(i) == Effect::PathLayers ||
            Effect(i) == Effect::IdMattes || Effect(i) == Effect::DeepSamples;
        const bool is_counted =
            scene::info(Effect(i)).kind != scene::EffectKind::Output || costs_paths;
        EXPECT_EQ(!scene::info(Effect(i)).calls.empty(), is_counted);
    }
    EXPECT_EQ(scene::find_effect("no-such-effect"), std::nullopt);
}

}  // namespace
}  // namespace velatura::test
