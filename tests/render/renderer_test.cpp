// SPDX-License-Identifier: Apache-2.0
#include "render/renderer.h"

#include "../identities/usd_render.h"
#include "accel/accelerator_factory.h"
#include "accel/bvh.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace velatura::test {
namespace {

constexpr int width = 20, height = 15;

/// The room with three tuffets of an instancer before the wall, one of them glowing.
std::string room_with_instances() {
    std::string text = room_usda();
    text.insert(text.find("    def RectLight \"Key\""), R"usda(    def PointInstancer "Tuffets"
    {
        int[] protoIndices = [0, 0, 1]
        point3f[] positions = [(-2, 0.25, 2), (0, 0.25, 2.25), (2, 0.25, 1.5)]
        rel prototypes = [</Root/Tuffets/A>, </Root/Tuffets/B>]
        def Cube "A"
        {
            double size = 0.5
            color3f[] primvars:displayColor = [(0.25, 0.75, 0.25)]
        }
        def Mesh "B" (prepend apiSchemas = ["MaterialBindingAPI"])
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(-0.5, 0, 0), (0.5, 0, 0), (0, 1, 0.25)]
            uniform token subdivisionScheme = "none"
            rel material:binding = </Root/Glow>
        }
    }
)usda");
    return text;
}

scene::Scene room() {
    return scene_from_usda(room_with_instances(), width, height);
}

render::Settings settings_of(const scene::Scene& scene) {
    render::Settings settings;
    settings.layers.matrix_layers = true;
    settings.layers = render::with_rows(std::move(settings.layers), scene);
    settings.guiding = integrator::Guiding::Off;
    settings.schedule.end_sample = 4;
    return settings;
}

uint64_t rendered(render::Renderer& renderer) {
    Diagnostics diagnostics;
    renderer.prepare(diagnostics);
    renderer.advance();
    EXPECT_EQ(diagnostics.error_count(), 0u);
    return fingerprint(renderer.film());
}

uint64_t rendered_afresh(const scene::Scene& scene, const render::Settings& settings) {
    render::Renderer renderer(scene, settings);
    return rendered(renderer);
}

/// Own trees that are counted.
class CountedTrees final : public accel::AcceleratorFactory {
  public:
    Result<std::unique_ptr<accel::Accelerator>> build(const accel::SoupScene& soup) const override {
        ++count;
        return accel::build_bvh(soup);
    }

    mutable int count = 0;
};

/// What an edit leaves as it is.
struct Kept {
    bool tree = false;    ///< no tree is built
    bool meshes = false;  ///< no mesh is cut into triangles
    bool lights = false;  ///< no table of emissive triangles is made
};

struct Edit {
    std::string name;
    std::function<void(render::Renderer&)> apply;
    Kept kept;
};

Mat4 at(const Vec3& p, float scale = 1.0f) {
    Mat4 m;
    m.setScale(scale);
    for (int i = 0; i < 3; ++i) m[3][i] = p[i];
    return m;
}

const std::vector<Edit>& edits() {
    static const std::vector<Edit> table = {
        {"camera",
         [](render::Renderer& r) {
             scene::Camera camera = r.scene().camera;
             camera.render_from_camera[3][0] = 0.75;
             camera.render_from_camera[3][2] = -0.5;
             camera.window_left *= 0.5;
             r.set_camera(camera);
         },
         {.tree = true, .meshes = true, .lights = true}},
        {"size and crop",
         [](render::Renderer& r) {
             r.set_size(30, 12, film::Window{3, 2, 25, 11});
         },
         {.tree = true, .meshes = true, .lights = true}},
        {"light",
         [](render::Renderer& r) {
             scene::Light light = r.scene().lights[0];
             light.Le *= Rgb(0.25f, 2.0f, 1.0f);
             light.render_from_light[3][1] += 0.5;
             r.set_light(0, light);
         },
         {.tree = true, .meshes = true}},
        {"material",
         [](render::Renderer& r) {
             for (size_t i = 0; i < r.scene().materials.size(); ++i) {
                 scene::Material m = r.scene().materials[i];
                 m.emissive_color.value *= 0.5f;
                 m.roughness.value = Rgb(0.6f);
                 r.set_material(scene::MaterialId(i), m);
             }
         },
         {.tree = true, .meshes = true}},
        {"material that begins to glow and lets light pass",
         [](render::Renderer& r) {
             scene::Material m;
             m.emissive_color = scene::Input(Rgb(1.0f, 0.5f, 0.25f));
             m.opacity = scene::Input(0.5f);
             m.ior = scene::Input(1.25f);
             r.set_material(1, m);
         },
         {.tree = true, .meshes = true}},
        {"instance",
         [](render::Renderer& r) { r.set_instance(2, at(Vec3(0.5f, -0.5f, -3.5f), 0.5f)); },
         {.tree = true, .meshes = true}},
        {"hidden instance",
         [](render::Renderer& r) {
             r.set_instance_visible(2, false);
             r.set_instance_visible(0, false);
         },
         {.tree = true, .meshes = true}},
        {"shape",
         [](render::Renderer& r) {
             for (size_t i = 0; i < r.scene().shapes.size(); ++i) {
                 scene::Shape shape = r.scene().shapes[i];
                 auto* const gprim = std::get_if<scene::Gprim>(&shape.geometry);
                 if (!gprim) continue;
                 for (double* size : {&gprim->radius, &gprim->size}) *size *= 0.5;
                 r.set_shape(i, shape);
             }
         },
         {}},
        {"hidden shape", [](render::Renderer& r) { r.set_shape_visible(0, false); }, {}},
    };
    return table;
}

// Whatever was rendered before, a scene that was edited is the scene that it now is: the same bits
// as from a renderer that never saw another one.
TEST(RendererEdits, GiveTheBitsOfARendererOfTheEditedScene) {
    for (const Edit& edit : edits()) {
        render::Renderer renderer(room(), settings_of(room()));
        const uint64_t before = rendered(renderer);
        edit.apply(renderer);
        const uint64_t after = rendered(renderer);
        EXPECT_NE(before, after) << edit.name << " changes nothing";
        EXPECT_EQ(after, rendered_afresh(renderer.scene(), renderer.settings())) << edit.name;
    }
}

TEST(RendererEdits, FollowEachOtherInAnyOrder) {
    render::Renderer forward(room(), settings_of(room())), backward(room(), settings_of(room()));
    rendered(forward);
    const std::vector<size_t> independent = {0, 2, 3, 5, 7};
    for (const size_t i : independent) {
        edits()[i].apply(forward);
        rendered(forward);
    }
    for (auto i = independent.rbegin(); i != independent.rend(); ++i) edits()[*i].apply(backward);
    EXPECT_EQ(rendered(forward), rendered(backward));
}

// A camera moves without a tree or a table, a light without geometry, an instance without the
// trees of prototypes.
TEST(RendererEdits, MakeOnlyWhatDependsOnThem) {
    for (const Edit& edit : edits()) {
        const CountedTrees trees;
        render::Settings settings = settings_of(room());
        settings.world.accelerator = &trees;
        render::Renderer renderer(room(), settings);
        rendered(renderer);
        const auto meshes = renderer.world().geometry.shapes().data();
        const auto glowing = renderer.world().lights.surfaces();
        edit.apply(renderer);
        rendered(renderer);
        EXPECT_EQ(trees.count == 1, edit.kept.tree) << edit.name;
        EXPECT_EQ(renderer.world().geometry.shapes().data() == meshes, edit.kept.meshes)
            << edit.name;
        if (edit.kept.lights) {
            EXPECT_EQ(renderer.world().lights.surfaces(), glowing) << edit.name;
        }
    }
}

TEST(RendererEdits, ShowAgainWhatWasHidden) {
    render::Renderer renderer(room(), settings_of(room()));
    const uint64_t before = rendered(renderer);
    renderer.set_instance_visible(1, false);
    renderer.set_shape_visible(2, false);
    EXPECT_NE(rendered(renderer), before);
    renderer.set_shape_visible(2, true);
    renderer.set_instance_visible(1, true);
    EXPECT_EQ(rendered(renderer), before);
    // What is moved while it is hidden is there when it is shown
    renderer.set_instance_visible(1, false);
    renderer.set_instance(1, at(Vec3(-1.0f, -0.5f, -2.0f)));
    const uint64_t hidden = rendered(renderer);
    renderer.set_instance_visible(1, true);
    EXPECT_NE(rendered(renderer), hidden);
    render::Renderer moved(room(), settings_of(room()));
    moved.set_instance(1, at(Vec3(-1.0f, -0.5f, -2.0f)));
    EXPECT_EQ(rendered(renderer), rendered(moved));
}

// A plane at depth 4 of a camera that goes 1.5 towards it and 1 aside: its points are where they
// were, and 2.5 away. All numbers are exact.
TEST(RendererEdits, MoveTheCameraThroughTheWorld) {
    scene::Scene scene = scene_from_usda(R"usda(#usda 1.0
def Mesh "Wall"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-64, -64, -4), (64, -64, -4), (64, 64, -4), (-64, 64, -4)]
    uniform token subdivisionScheme = "none"
}
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0, 0)
}
)usda",
                                         8, 6);
    render::Renderer renderer(std::move(scene), settings_of(room()));
    const auto look = [&] {
        Diagnostics diagnostics;
        renderer.prepare(diagnostics);
        film::SampleRadiance out(renderer.layers());
        integrator::RayCounts counts;
        renderer.tracer().trace(3, 2, 0, out, counts);
        return std::array<float, 4>{out.P.x, out.P.y, out.P.z, out.Z};
    };
    const auto before = look();
    EXPECT_EQ(before[3], 4.0f);
    scene::Camera camera = renderer.scene().camera;
    camera.render_from_camera[3][0] = 1.0;
    camera.render_from_camera[3][2] = -1.5;
    renderer.set_camera(camera);
    const auto after = look();
    EXPECT_EQ(after[3], 2.5f);
    EXPECT_EQ(after[2], before[2]);
    // By similar triangles
    EXPECT_NEAR(after[0] - 1.0f, before[0] * 2.5f / 4.0f, 1e-6f);
    EXPECT_NEAR(after[1], before[1] * 2.5f / 4.0f, 1e-6f);
}

TEST(Renderer, GoesOnToMoreSamples) {
    render::Renderer whole(room(), settings_of(room())), parts(room(), settings_of(room()));
    Diagnostics diagnostics;
    parts.prepare(diagnostics);
    parts.advance_to(1);
    parts.advance_to(3);
    parts.advance_to(4);
    EXPECT_EQ(fingerprint(parts.film()), rendered(whole));
}

// Two in one process, one in the other's making, and two of one world.
TEST(Renderer, KnowsNothingOfOthers) {
    render::Renderer first(room(), settings_of(room()));
    const uint64_t alone = rendered(first);
    render::Renderer second(room(), settings_of(room()));
    Diagnostics diagnostics;
    second.prepare(diagnostics);
    second.advance_to(2);
    render::Renderer third(second.shared_world(), settings_of(room()));
    EXPECT_EQ(rendered(third), alone);
    second.advance_to(4);
    EXPECT_EQ(fingerprint(second.film()), alone);
}

}  // namespace
}  // namespace velatura::test
