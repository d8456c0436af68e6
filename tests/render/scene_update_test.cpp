// SPDX-License-Identifier: Apache-2.0
#include "render/scene_update.h"

#include "../identities/usd_render.h"
#include "render/load_scene.h"
#include "usd/layer/layer_builder.h"
#include "usd/stage/open_layer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace velatura::test {
namespace {

/// What sequences of edits turn.
struct StageState {
    double camera_x = 0;
    int width = 12;
    double key = 4, fill = 2;
    double gel = 1;  ///< of the filter of the key
    double roughness = 0.5, glow = 0;
    double stone_x = 0, block_size = 1;
    double cage_size = 0;  ///< 0: none; a subdivision surface
    bool has_ball = true, has_fill = true, is_block_visible = true;
    bool catches = false;  ///< the floor is a catcher
};

std::string usda_of(const StageState& s, double camera_x) {
    std::string text =
        fmt::format(R"usda(#usda 1.0
def Camera "Cam"
{{
    float focalLength = 24
    double3 xformOp:translate = ({}, 1, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Mesh "Floor"
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
    uniform token subdivisionScheme = "none"
    bool primvars:velatura:catcher = {}
}}
def Material "Mat"
{{
    token outputs:surface.connect = </Mat/Surface.outputs:surface>
    def Shader "Surface"
    {{
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = {}
        color3f inputs:emissiveColor = ({}, 0, 0)
        token outputs:surface
    }}
}}
def Cube "Block" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    double size = {}
    token visibility = "{}"
    rel material:binding = </Mat>
}}
def PointInstancer "Stones"
{{
    int[] protoIndices = [0, 0]
    point3f[] positions = [({}, 0.25, 1), (1.5, 0.25, 1)]
    rel prototypes = [</Stones/A>]
    def Sphere "A"
    {{
        double radius = 0.25
    }}
}}
def SphereLight "Key"
{{
    float inputs:intensity = {}
    rel light:filters = </Gel>
    double3 xformOp:translate = (1, 3, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def PxrIntMultLightFilter "Gel"
{{
    float inputs:ri:lightFilter:intensity = {}
}}
)usda",
                    camera_x, int(s.catches), s.roughness, s.glow, s.block_size,
                    s.is_block_visible ? "inherited" : "invisible", s.stone_x, s.key, s.gel);
    if (s.has_ball) text += "def Sphere \"Ball\"\n{\n    double radius = 0.5\n}\n";
    if (s.has_fill)
        text += fmt::format("def DomeLight \"Fill\"\n{{\n    float inputs:intensity = {}\n}}\n",
                            s.fill * 0.1);
    if (s.cage_size > 0)
        text += fmt::format(R"usda(def Mesh "Cage"
{{
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]
    point3f[] points = [(-{0}, 0, 0), ({0}, 0, 0), (0, 0, -{0}), (0, {0}, 0)]
}}
)usda",
                            s.cage_size);
    return text;
}

/// In render space of the camera that has not moved.
scene::Scene scene_of(const StageState& s) {
    scene::Scene scene = scene_from_usda(usda_of(s, 0), s.width, 9);
    if (s.camera_x != 0)
        scene.camera = render::rebased(scene_from_usda(usda_of(s, s.camera_x), s.width, 9).camera,
                                       scene.camera.world_position);
    return scene;
}

render::Settings settings_of(const scene::Scene& scene) {
    render::Settings settings;
    settings.layers = render::with_rows({}, scene);
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    settings.schedule.end_sample = 2;
    return settings;
}

uint64_t rendered(render::Renderer& renderer) {
    Diagnostics diagnostics;
    renderer.prepare(diagnostics);
    renderer.advance();
    return fingerprint(renderer.film());
}

uint64_t rendered_afresh(const StageState& state) {
    scene::Scene scene = scene_of(state);
    render::Settings settings = settings_of(scene);
    render::Renderer renderer(std::move(scene), std::move(settings));
    return rendered(renderer);
}

using Turn = std::function<void(StageState&, double)>;

/// Each takes a number of [0, 1).
const std::vector<Turn>& turns() {
    static const std::vector<Turn> list = {
        [](StageState& s, double u) { s.camera_x = u - 0.5; },
        [](StageState& s, double u) { s.width = 8 + int(8 * u); },
        [](StageState& s, double u) { s.key = 8 * u; },
        [](StageState& s, double u) { s.fill = 4 * u; },
        [](StageState& s, double u) { s.gel = 2 * u; },
        [](StageState& s, double u) { s.roughness = u; },
        [](StageState& s, double u) { s.glow = u < 0.5 ? 0 : u; },
        [](StageState& s, double u) { s.stone_x = 2 * u - 1; },
        [](StageState& s, double u) { s.block_size = 0.5 + u; },
        [](StageState& s, double u) { s.has_ball = u < 0.5; },
        [](StageState& s, double u) { s.has_fill = u < 0.5; },
        [](StageState& s, double u) { s.is_block_visible = u < 0.5; },
        [](StageState& s, double u) { s.cage_size = u < 0.5 ? 0 : u; },
    };
    return list;
}

TEST(SceneUpdate, EndsInTheImageOfTheFinalStage) {
    constexpr int sequences = 240;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> number(0.0, 1.0);
    int replaced = 0, edited = 0;
    for (int i = 0; i < sequences; ++i) {
        StageState state;
        scene::Scene scene = scene_of(state);
        render::Settings settings = settings_of(scene);
        render::Renderer renderer(std::move(scene), std::move(settings));
        // What was rendered before must not show
        if (i % 2 == 0) rendered(renderer);
        const int count = 1 + int(4 * number(random));
        std::string history;
        for (int k = 0; k < count; ++k) {
            const size_t turn = size_t(double(turns().size()) * number(random));
            turns()[turn](state, number(random));
            const render::UpdateReport report = render::update(renderer, scene_of(state));
            history += fmt::format("{}: {}; ", turn, report.text());
            report.is_replaced ? ++replaced : ++edited;
            if (number(random) < 0.3) rendered(renderer);
        }
        ASSERT_EQ(rendered(renderer), rendered_afresh(state))
            << "sequence " << i << ": " << history;
    }
    // Both ways were taken
    EXPECT_GT(edited, sequences / 4);
    EXPECT_GT(replaced, sequences / 4);
}

/// The world of a plate follows the scene's.
TEST(SceneUpdate, PlatesFollow) {
    for (size_t turn = 0; turn < turns().size(); ++turn) {
        StageState state;
        state.catches = true;
        scene::Scene scene = scene_of(state);
        render::Settings settings = settings_of(scene);
        render::Renderer renderer(std::move(scene), std::move(settings));
        const uint64_t before = rendered(renderer);
        turns()[turn](state, 0.7);
        render::update(renderer, scene_of(state));
        const uint64_t after = rendered(renderer);
        ASSERT_EQ(after, rendered_afresh(state)) << turn;
        if (turn < 4) {
            EXPECT_NE(after, before) << turn;
        }
    }
}

TEST(SceneUpdate, StatesWhatItDid) {
    struct Case {
        Turn turn;
        std::string text;
    };

    const std::vector<Case> cases = {
        {[](StageState&, double) {}, "unchanged"},
        {[](StageState& s, double) { s.camera_x = 1; }, "camera edited"},
        {[](StageState& s, double) { s.width = 9; }, "camera edited"},
        {[](StageState& s, double) { s.key = 1; }, "1 light edited"},
        {[](StageState& s, double) { s.key = s.fill = 1; }, "2 lights edited"},
        {[](StageState& s, double) { s.roughness = 0.25; }, "1 material edited"},
        {[](StageState& s, double) { s.stone_x = 0.5; }, "1 instance edited"},
        {[](StageState& s, double) { s.block_size = 2; }, "1 shape edited"},
        {[](StageState& s, double) { s.block_size = s.key = 2; }, "1 light, 1 shape edited"},
        {[](StageState& s, double) { s.has_ball = false; }, "scene replaced: prims"},
        {[](StageState& s, double) { s.has_fill = false; }, "scene replaced: prims"},
    };
    for (const Case& c : cases) {
        StageState state;
        scene::Scene scene = scene_of(state);
        render::Settings settings = settings_of(scene);
        render::Renderer renderer(std::move(scene), std::move(settings));
        rendered(renderer);
        c.turn(state, 0);
        const render::UpdateReport report = render::update(renderer, scene_of(state));
        EXPECT_EQ(report.text(), c.text);
        EXPECT_EQ(report.is_unchanged(), c.text == "unchanged");
    }
}

TEST(SceneUpdate, DicesForAnotherCameraUnlessToldToKeep) {
    StageState state;
    state.cage_size = 0.5;
    scene::Scene scene = scene_of(state);
    render::Settings settings = settings_of(scene);
    render::Renderer renderer(std::move(scene), std::move(settings));
    state.camera_x = 0.5;
    EXPECT_EQ(render::update(renderer, scene_of(state), {.keeps_dicing = true}).text(),
              "camera edited");
    state.camera_x = 1;
    EXPECT_EQ(render::update(renderer, scene_of(state)).text(),
              "scene replaced: dicing for another camera");
    EXPECT_EQ(rendered(renderer), rendered_afresh(state));
}

// The layers of a renderer without rows of lights stay so
TEST(SceneUpdate, NamesTheRowsOfNewLights) {
    StageState state;
    state.has_fill = false;
    scene::Scene scene = scene_of(state);
    render::Settings settings = settings_of(scene);
    render::Renderer renderer(std::move(scene), std::move(settings));
    const size_t rows = renderer.settings().layers.groups.size();
    state.has_fill = true;
    render::update(renderer, scene_of(state));
    ASSERT_EQ(renderer.settings().layers.groups.size(), rows + 1);
    EXPECT_EQ(renderer.settings().layers, render::with_rows({}, renderer.scene()));
}

// A stage in memory is the scene of the same stage in a file
TEST(LoadScene, TakesAStageInMemory) {
    using usd::layer::Path;
    using usd::layer::Value;
    usd::layer::LayerBuilder builder;
    const Path ball = Path::from("/Ball"), lamp = Path::from("/Lamp");
    ASSERT_TRUE(builder.define(Path::from("/Cam"), "Camera"));
    ASSERT_TRUE(builder.define(ball, "Sphere"));
    ASSERT_TRUE(builder.set(ball.append_property("radius"), "double", Value(0.5)));
    ASSERT_TRUE(builder.set(ball.append_property("xformOp:translate"), "double3",
                            Value(usd::layer::Vec3d(0, 0, -5))));
    ASSERT_TRUE(builder.set(ball.append_property("xformOpOrder"), "token[]",
                            Value::array(std::vector{usd::layer::Token("xformOp:translate")})));
    ASSERT_TRUE(builder.define(lamp, "DistantLight"));
    Diagnostics diagnostics;
    const Result<usd::stage::Stage> stage =
        usd::stage::open_layer(builder.layer(), {}, diagnostics);
    ASSERT_TRUE(stage.has_value());
    render::LoadOptions options;
    options.translate.resolution = {12, 9};
    Result<scene::Scene> scene = render::load_scene(*stage, options, diagnostics);
    ASSERT_TRUE(scene.has_value());
    render::Settings settings = settings_of(*scene);
    render::Renderer in_memory(std::move(*scene), settings);
    scene::Scene of_file = scene_from_usda(R"usda(#usda 1.0
def Camera "Cam"
{
}
def Sphere "Ball"
{
    double radius = 0.5
    double3 xformOp:translate = (0, 0, -5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "Lamp"
{
}
)usda",
                                           12, 9);
    render::Renderer from_file(std::move(of_file), settings);
    EXPECT_EQ(rendered(in_memory), rendered(from_file));
}

}  // namespace
}  // namespace velatura::test
