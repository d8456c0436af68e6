// SPDX-License-Identifier: Apache-2.0
#include "usd_render.h"

#include "../media/grid_fixtures.h"
#include "base/atomic_file.h"
#include "base/hash.h"
#include "base/tasks.h"
#include "media/load_volumes.h"
#include "render/renderer.h"
#include "translate/translate.h"
#include "usd/stage/stage.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace velatura::test {

namespace {

/// Files that need not be there: what a grid holds is its name.
class NamedGrids final : public media::VolumeSource {
  public:
    Result<scene::VoxelGrid> read(const media::GridRequest& request) const override {
        if (request.grid == "ball" && request.kind != scene::GridKind::Densities) {
            const auto distance = [](int x, int y, int z) {
                return 0.1f * (Vec3(float(x), float(y), float(z)) - Vec3(9.3f)).length() - 0.7f;
            };
            return media::testing::make_voxel_grid(scene::Vec3i(20), 0.1f, distance, 0.3f, true);
        }
        if (request.grid != "waves" && request.grid != "zeros")
            return Error{"volume-grid", "no such grid"};
        const auto wave = [](int x, int y, int z) {
            return 1.0f + std::sin(0.4f * float(x) + 0.7f * float(y) + 0.9f * float(z));
        };
        return media::testing::make_voxel_grid(scene::Vec3i(20), 0.1f, [&](int x, int y, int z) {
            return request.grid == "waves" ? wave(x, y, z) : 0.0f;
        });
    }
};

void replace(std::string& text, const std::string& what, const std::string& by) {
    const size_t at = text.find(what);
    VELATURA_CHECK(at != std::string::npos, "the room has changed");
    text.replace(at, what.size(), by);
}

}  // namespace

scene::Scene scene_from_usda(const std::string& text, int width, int height, bool finds_casters) {
    static int counter = 0;
    const std::string path = (std::filesystem::temp_directory_path() /
                              fmt::format("velatura_identity_{}_{}.usda", ::getpid(), counter++))
                                 .string();
    const Result<void> written = write_file_atomically(path, text);
    VELATURA_CHECK(written.has_value(), "cannot write a temporary scene");
    // For lights with a profile; the same whoever writes it
    const auto lamp = std::filesystem::temp_directory_path() / "velatura_identity_lamp.ies";
    if (!std::filesystem::exists(lamp))
        VELATURA_CHECK(
            write_file_atomically(
                lamp.string(),
                "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 90 180\n0\n3 1 0.5\n")
                .has_value(),
            "cannot write a profile");
    Diagnostics diagnostics;
    Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    std::filesystem::remove(path);
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    VELATURA_CHECK(stage.has_value(), "the scene of a test does not open");
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{width, height};
    options.time = 0.0;
    options.finds_casters = finds_casters;
    Result<scene::Scene> scene = translate::translate_stage(*stage, options, diagnostics);
    if (scene) media::load_volumes(*scene, NamedGrids(), SIZE_MAX, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) {
        if (d.severity == Severity::Error) ADD_FAILURE() << diagnostics.format(d);
    }
    VELATURA_CHECK(scene.has_value(), "the scene of a test does not translate");
    return std::move(*scene);
}

film::Film render_scene(const scene::Scene& scene,
                        const integrator::RenderOptions& options,
                        const RenderSetup& setup) {
    const ThreadLimit limit(setup.threads);
    render::Settings settings;
    settings.layers.last_bounce = 3;
    settings.layers.matrix_layers = settings.layers.shadow_layers = settings.layers.halves = true;
    settings.layers.caster_layers = !scene.casters.list.empty();
    settings.layers = render::with_rows(std::move(settings.layers), scene);
    settings.world = {.light_selection = setup.light_selection,
                      .bvh_quality = setup.bvh_quality,
                      .forced = setup.forced};
    settings.tracer = {
        .seed = options.seed, .max_depth = options.max_depth, .sampler = setup.sampler};
    settings.tracer.estimator.roulette = setup.roulette;
    const integrator::SplittingMap branches(std::max(setup.branches, 1u));
    settings.splits = setup.branches == 0;
    if (!settings.splits) settings.tracer.branches = &branches;
    settings.guiding = setup.guiding;
    settings.caustics = setup.caustics;
    settings.schedule = options;
    settings.window = setup.window;
    Diagnostics diagnostics;
    render::Renderer renderer(scene, std::move(settings));
    renderer.build(diagnostics);
    std::vector<uint64_t> ends = setup.sample_splits;
    ends.push_back(options.end_sample);
    for (const uint64_t end : ends) {
        // As another process would that goes on
        renderer.learn();
        const integrator::RenderResult result = renderer.advance_to(end);
        if (setup.counts) *setup.counts += result.rays;
        renderer.schedule().first_sample = end;
    }
    EXPECT_EQ(renderer.film().invalid_count(), 0u);
    return renderer.take_film();
}

uint64_t fingerprint(const film::Film& film) {
    uint64_t h = 0;
    const accumulate::AccumulatorTable& table = film.sums().table();
    for (int y = film.window().y0; y < film.window().y1; ++y) {
        for (int x = film.window().x0; x < film.window().x1; ++x) {
            for (uint32_t a = 0; a < table.total_count(); ++a) {
                const accumulate::Triple t = film.sums().total(x, y, a);
                for (const double v : {t.x, t.y, t.z})
                    h = hash_combine(h, std::bit_cast<uint64_t>(v + 0.0));
            }
        }
    }
    return h;
}

std::vector<double> beauty(const film::Film& film) {
    std::vector<double> out;
    for (int y = film.window().y0; y < film.window().y1; ++y) {
        for (int x = film.window().x0; x < film.window().x1; ++x) {
            const accumulate::Triple t =
                film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
            out.insert(out.end(), {t.x, t.y, t.z});
        }
    }
    return out;
}

std::string room_usda(const std::string& root_ops) {
    // Every coordinate lies on a grid of 2^-10, so that a shift by 2^30 is exact in double
    return R"usda(#usda 1.0
(
    defaultPrim = "Root"
    upAxis = "Y"
)
def Xform "Root"
{
)usda" + root_ops +
           R"usda(
    def Camera "Cam"
    {
        float focalLength = 24
        float2 clippingRange = (0, 0)
        double3 xformOp:translate = (0, 1, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 5, 4]
        point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3), (-3, 4, -3), (3, 4, -3)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.75, 0.5, 0.25)]
    }
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 0.75
        rel material:binding = </Root/Gloss>
        double3 xformOp:translate = (-1, 0.75, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Sphere "Glass" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 0.5
        rel material:binding = </Root/GlassMaterial>
        double3 xformOp:translate = (0.25, 0.5, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Cube "Block" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double size = 1
        rel material:binding = </Root/Metal>
        double3 xformOp:translate = (1.25, 0.5, 0)
        float xformOp:rotateY = 30
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    }
    def Mesh "Panel" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-2.75, 1, -2.5), (-2.75, 1, -1.5),
            (-2.5, 2.5, -1.5), (-2.5, 2.5, -2.5)]
        uniform token subdivisionScheme = "none"
        rel material:binding = </Root/Glow>
    }
    def Material "Glow"
    {
        token outputs:surface.connect = </Root/Glow/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:emissiveColor = (2, 3, 4)
            token outputs:surface
        }
    }
    def Material "Gloss"
    {
        token outputs:surface.connect = </Root/Gloss/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.2, 0.4, 0.8)
            float inputs:roughness = 0.3
            float inputs:clearcoat = 0.5
            token outputs:surface
        }
    }
    def Material "GlassMaterial"
    {
        token outputs:surface.connect = </Root/GlassMaterial/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:opacity = 0
            float inputs:roughness = 0
            token outputs:surface
        }
    }
    def Material "Metal"
    {
        token outputs:surface.connect = </Root/Metal/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.9, 0.7, 0.3)
            float inputs:metallic = 1
            float inputs:roughness = 0.2
            token outputs:surface
        }
    }
    def RectLight "Key"
    {
        float inputs:intensity = 6
        float inputs:width = 1
        float inputs:height = 2
        double3 xformOp:translate = (2, 3, 2)
        float xformOp:rotateX = -60
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }
    def SphereLight "Lamp"
    {
        float inputs:intensity = 20
        float inputs:radius = 0.25
        color3f inputs:color = (1, 0.75, 0.5)
        double3 xformOp:translate = (-2, 2.5, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DistantLight "Sun"
    {
        float inputs:intensity = 2000
        float inputs:angle = 2
        float xformOp:rotateX = -50
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }
    def DomeLight "Env"
    {
        float inputs:intensity = 0.25
    }
}
)usda";
}

std::string soft_room() {
    std::string text = room_usda();
    replace(text, "inputs:intensity = 2000", "inputs:intensity = 2");
    replace(text, "inputs:angle = 2", "inputs:angle = 60");
    replace(text, "inputs:intensity = 20", "inputs:intensity = 5");
    replace(text, "inputs:radius = 0.25", "inputs:radius = 0.75");
    replace(text, "(-2.75, 1, -2.5), (-2.75, 1, -1.5)", "(-2.75, 1, -1.5), (-2.75, 1, 1.5)");
    replace(text, "(-2.5, 2.5, -1.5), (-2.5, 2.5, -2.5)", "(-2.5, 3.5, 1.5), (-2.5, 3.5, -1.5)");
    replace(text, "inputs:roughness = 0.2\n", "inputs:roughness = 0.6\n");
    return text;
}

}  // namespace velatura::test
