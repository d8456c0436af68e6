// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/test_assets.h"
#include "hydra_host.h"
#include "layers/resolve.h"
#include "render/load_scene.h"
#include "render/renderer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pxr/base/gf/rotation.h>
#include <pxr/imaging/hd/tokens.h>
#include <pxr/usd/usdGeom/camera.h>
#include <pxr/usd/usdGeom/cube.h>
#include <pxr/usd/usdGeom/imageable.h>
#include <pxr/usd/usdGeom/mesh.h>
#include <pxr/usd/usdGeom/sphere.h>
#include <pxr/usd/usdGeom/xformCommonAPI.h>
#include <pxr/usd/usdLux/sphereLight.h>
#include <pxr/usd/usdShade/materialBindingAPI.h>
#include <pxr/usd/usdShade/shader.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

constexpr int width = 48, height = 36;

HostSettings quick() {
    HostSettings settings;
    settings.spp = 4;
    settings.adaptive = false;
    settings.guiding = "off";
    return settings;
}

/// The image of the stage's file, as `velatura render` makes it: R, G, B, A from the top.
struct Reference {
    std::string camera;
    std::vector<float> rgba;
};

std::optional<Reference> render_file(const std::string& file,
                                     const HostSettings& host,
                                     int w = width,
                                     int h = height) {
    Diagnostics diagnostics;
    render::LoadOptions options;
    options.translate.resolution = {w, h};
    Result<scene::Scene> scene = render::load_scene(file, options, diagnostics);
    if (!scene) return std::nullopt;
    scene->settings.data_window_ndc = {0, 0, 1, 1};
    render::Settings settings = to_settings(host);
    settings.layers = render::with_rows(settings.layers, *scene);
    Reference reference;
    reference.camera = scene->camera.name;
    render::Renderer renderer(*std::move(scene), std::move(settings));
    renderer.prepare(diagnostics);
    renderer.advance();
    const layers::ResolvedLayers resolved = layers::resolve_layers(renderer.film().sums());
    for (size_t i = 0; i < size_t(w) * size_t(h); ++i)
        for (const char* const channel : {"R", "G", "B", "A"})
            reference.rgba.push_back(resolved.image.find(channel)->value(i));
    return reference;
}

/// Of two images of floats.
struct Difference {
    size_t pixels = 0;  ///< that differ in some bit
    double mean = 0;    ///< mean of |a − b| over the mean of |b|
};

Difference difference(const std::vector<float>& a, const std::vector<float>& b) {
    Difference d;
    double sum = 0, norm = 0;
    EXPECT_EQ(a.size(), b.size());
    for (size_t i = 0; i + 3 < std::min(a.size(), b.size()); i += 4) {
        bool is_same = true;
        for (size_t c = 0; c < 4; ++c) {
            is_same = is_same && std::bit_cast<uint32_t>(a[i + c] + 0.0f) ==
                                     std::bit_cast<uint32_t>(b[i + c] + 0.0f);
            sum += std::abs(double(a[i + c]) - double(b[i + c]));
            norm += std::abs(double(b[i + c]));
        }
        if (!is_same) ++d.pixels;
    }
    EXPECT_GT(norm, 0.0);
    d.mean = sum / norm;
    return d;
}

struct SceneCase {
    const char* file;                                ///< below scenes/
    bool is_same_with_delegate, is_same_with_index;  ///< bit for bit
};

class KeptScenes : public testing::TestWithParam<SceneCase> {};

std::string name_of(Frontend frontend) {
    return frontend == Frontend::SceneDelegate ? "scene delegate" : "scene index";
}

void compare_with_file(const std::string& file, Frontend frontend, bool is_same) {
    const std::optional<Reference> reference = render_file(file, quick());
    ASSERT_TRUE(reference.has_value());
    // Something is seen
    float darkest = reference->rgba[0], brightest = darkest;
    for (size_t i = 0; i < reference->rgba.size(); i += 4) {
        darkest = std::min(darkest, reference->rgba[i]);
        brightest = std::max(brightest, reference->rgba[i]);
    }
    EXPECT_LT(darkest, brightest);
    const UsdStageRefPtr stage = UsdStage::Open(file);
    ASSERT_TRUE(stage);
    Host host(stage, frontend, SdfPath(reference->camera), width, height, quick());
    host.finish();
    const Difference d = difference(host.read("color").floats, reference->rgba);
    fmt::print("{} through the {}: {} of {} pixels differ, mean {:.2e}\n",
               std::filesystem::path(file).filename().string(), name_of(frontend), d.pixels,
               width * height, d.mean);
    if (is_same) {
        EXPECT_EQ(d.pixels, 0u);
    } else {
        EXPECT_LT(d.mean, 0.25);
    }
}

TEST_P(KeptScenes, AreTheImageOfTheirFile) {
    const std::string file = std::string(VELATURA_SCENES) + "/" + GetParam().file;
    compare_with_file(file, Frontend::SceneDelegate, GetParam().is_same_with_delegate);
    compare_with_file(file, Frontend::SceneIndex, GetParam().is_same_with_index);
}

INSTANTIATE_TEST_SUITE_P(Hydra,
                         KeptScenes,
                         testing::Values(SceneCase{"cornell/cornell.usda", true, true},
                                         SceneCase{"transport/doorway.usda", false, true},
                                         SceneCase{"transport/gloss.usda", false, true},
                                         SceneCase{"transport/many_lights.usda", true, true},
                                         SceneCase{"transport/linked.usda", false, false},
                                         SceneCase{"transport/glass.usda", false, true},
                                         SceneCase{"transport/window.usda", false, false},
                                         SceneCase{"sky/sky.usda", false, false}),
                         [](const testing::TestParamInfo<SceneCase>& scene) {
                             std::string name =
                                 std::filesystem::path(scene.param.file).stem().string();
                             return name;
                         });

constexpr const char* instanced = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0.1, 1000)
    double3 xformOp:translate = (0, 1, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Floor" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 5, 4]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3), (-3, 4, -3), (3, 4, -3)]
    uniform token subdivisionScheme = "none"
    uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
    def GeomSubset "Wall" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </Red>
    }
}
def Material "Red"
{
    token outputs:surface.connect = </Red/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.75, 0.125, 0.125)
        float inputs:roughness = 0.25
        token outputs:surface
    }
}
def PointInstancer "Tiles"
{
    int[] protoIndices = [0, 1, 0, 1]
    point3f[] positions = [(-2, 0.5, 0), (-1, 0.5, 0), (0, 0.5, 0), (1, 0.5, 0)]
    quath[] orientations = [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0), (1, 0, 0, 0)]
    float3[] scales = [(1, 1, 1), (0.5, 0.5, 0.5), (1, 2, 1), (1, 1, 1)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)] (
        interpolation = "vertex"
    )
    rel prototypes = [</Tiles/A>, </Tiles/B>]
    def Mesh "A"
    {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(-0.5, 0, 0), (0.5, 0, 0), (0, 1, 0.25)]
        uniform token subdivisionScheme = "none"
    }
    def Xform "B"
    {
        def Mesh "Left" (prepend apiSchemas = ["MaterialBindingAPI"])
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(-0.5, 0, 0), (0, 0, 0), (0, 1, 0.25)]
            uniform token subdivisionScheme = "none"
            rel material:binding = </Red>
        }
        def Mesh "Right"
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(0, 0, 0), (0.5, 0, 0), (0, 1, 0.25)]
            uniform token subdivisionScheme = "none"
        }
    }
}
class Xform "Chair"
{
    def Mesh "Seat" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [
            (-0.25, 0.5, 0.25), (0.25, 0.5, 0.25), (0.25, 0.5, -0.25), (-0.25, 0.75, -0.25)
        ]
        uniform token subdivisionScheme = "none"
        rel material:binding = </Red>
    }
}
def Xform "Chair1" (instanceable = true
    inherits = </Chair>)
{
    double3 xformOp:translate = (1.5, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Chair2" (instanceable = true
    inherits = </Chair>)
{
    double3 xformOp:translate = (-1.5, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def RectLight "Key"
{
    float inputs:intensity = 8
    float inputs:width = 2
    double3 xformOp:translate = (0, 3.5, 1)
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
def DistantLight "Sun"
{
    float inputs:intensity = 0.5
    float inputs:angle = 1
}
)usda";

/// A file with a camera and a light over one that has none.
std::string with_camera(const std::string& file) {
    const std::string over =
        (std::filesystem::temp_directory_path() / "velatura_hydra_camera.usda").string();
    const std::string text = fmt::format(R"usda(#usda 1.0
(
    subLayers = [@{}@]
)
def Camera "HostCamera"
{{
    float focalLength = 35
    float2 clippingRange = (0.01, 10000)
    double3 xformOp:translate = (0, 10, 50)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def DistantLight "HostSun"
{{
    float inputs:angle = 1
    float3 xformOp:rotateXYZ = (-40, 30, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}}
)usda",
                                         file);
    EXPECT_TRUE(write_file_atomically(over, text).has_value());
    return over;
}

// Of the folder of public test files, if it is there
TEST(HydraAssets, AreTheImageOfTheirFile) {
    const std::filesystem::path teapot = test_assets() / "usd-wg/full_assets/Teapot/Teapot.usd";
    if (!std::filesystem::exists(teapot)) GTEST_SKIP() << "no assets";
    const std::string file = with_camera(teapot.string());
    for (const Frontend frontend : {Frontend::SceneDelegate, Frontend::SceneIndex})
        compare_with_file(file, frontend, true);
    std::filesystem::remove(file);
}

/// Geometry that is no polygon mesh without subdivision and no quadric, and lights of all kinds.
constexpr const char* shapes = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 24
    float fStop = 2
    float focusDistance = 6
    float exposure = 0.5
    float2 clippingRange = (0.1, 1000)
    double3 xformOp:translate = (0, 1, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Cage"
{
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [
        0, 1, 3, 2, 2, 3, 5, 4, 4, 5, 7, 6,
        6, 7, 1, 0, 1, 7, 5, 3, 6, 0, 2, 4
    ]
    point3f[] points = [
        (-2, 0, 1), (-1, 0, 1), (-2, 1, 1), (-1, 1, 1),
        (-2, 1, 0), (-1, 1, 0), (-2, 0, 0), (-1, 0, 0)
    ]
    int[] creaseIndices = [0, 1, 7, 6, 0]
    int[] creaseLengths = [5]
    float[] creaseSharpnesses = [4]
    uniform token subdivisionScheme = "catmullClark"
}
def BasisCurves "Hair"
{
    uniform token type = "cubic"
    uniform token basis = "bspline"
    uniform token wrap = "pinned"
    int[] curveVertexCounts = [4, 4]
    point3f[] points = [
        (0, 0, 0), (0.2, 0.5, 0), (0, 1, 0.2), (0.1, 1.5, 0),
        (0.5, 0, 0), (0.7, 0.5, 0), (0.5, 1, 0.2), (0.6, 1.5, 0)
    ]
    float[] widths = [0.1, 0.05] (
        interpolation = "uniform"
    )
    color3f[] primvars:displayColor = [(1, 0.5, 0.25), (0.25, 0.5, 1)] (
        interpolation = "uniform"
    )
}
def Points "Dew"
{
    point3f[] points = [(1, 0.25, 1), (1.5, 0.5, 0.5), (2, 0.25, 1)]
    float[] widths = [0.2, 0.4, 0.3]
    color3f[] primvars:displayColor = [(0.2, 0.9, 0.2)] (
        interpolation = "constant"
    )
}
def Mesh "Glow" (prepend apiSchemas = ["MeshLightAPI"])
{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(-1, 2, -1), (0, 2, -1), (-0.5, 2.5, -1)]
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 3
}
def DiskLight "Disk" (prepend apiSchemas = ["ShapingAPI", "ShadowAPI"])
{
    float inputs:intensity = 6
    float inputs:shaping:cone:angle = 40
    float inputs:shaping:cone:softness = 0.5
    color3f inputs:shadow:color = (0.25, 0, 0)
    double3 xformOp:translate = (0, 2, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def CylinderLight "Tube"
{
    float inputs:intensity = 4
    float inputs:length = 2
    float inputs:radius = 0.1
    bool inputs:enableColorTemperature = 1
    float inputs:colorTemperature = 4000
    double3 xformOp:translate = (0, 3, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky"
{
    float inputs:intensity = 0.25
    string velatura:light:group = "heaven"
}
)usda";

UsdStageRefPtr room_stage();

/// Instancers in prototypes of others, and in native instances.
constexpr const char* nested = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0.1, 1000)
    double3 xformOp:translate = (0, 1, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def PointInstancer "Outer"
{
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(-2, 0, 0), (0, 0.5, 0), (2, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0)]
    double3 xformOp:translate = (0, 0.25, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</Outer/Bush>]
    def Xform "Bush"
    {
        double3 xformOp:scale = (0.5, 0.5, 0.5)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def PointInstancer "Inner"
        {
            int[] protoIndices = [0, 0]
            point3f[] positions = [(-0.5, 0, 0), (0.5, 0, 0.25)]
            float3[] scales = [(1, 1, 1), (1, 2, 1)]
            rel prototypes = [</Outer/Bush/Inner/Leaf>]
            def Mesh "Leaf"
            {
                int[] faceVertexCounts = [3]
                int[] faceVertexIndices = [0, 1, 2]
                point3f[] points = [(-0.5, 0, 0), (0.5, 0, 0), (0, 1, 0.25)]
                uniform token subdivisionScheme = "none"
                color3f[] primvars:displayColor = [(0.25, 0.75, 0.25)]
            }
        }
    }
}
class Xform "Tree"
{
    def PointInstancer "Crown"
    {
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 1, 0), (0.25, 1.5, 0)]
        rel prototypes = [</Tree/Crown/Leaf>]
        def Mesh "Leaf"
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(-0.25, 0, 0), (0.25, 0, 0), (0, 0.5, 0.25)]
            uniform token subdivisionScheme = "none"
        }
    }
}
def Xform "Tree1" (instanceable = true
    inherits = </Tree>)
{
    double3 xformOp:translate = (-1, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Tree2" (instanceable = true
    inherits = </Tree>)
{
    double3 xformOp:translate = (1, 0, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "Sun"
{
    float inputs:intensity = 2
    float inputs:angle = 1
    float3 xformOp:rotateXYZ = (-30, 20, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
)usda";

void compare_text(const std::string& text, const std::string& name) {
    const std::string file =
        (std::filesystem::temp_directory_path() / ("velatura_hydra_" + name + ".usda")).string();
    ASSERT_TRUE(write_file_atomically(file, text).has_value());
    for (const Frontend frontend : {Frontend::SceneDelegate, Frontend::SceneIndex})
        compare_with_file(file, frontend, true);
    std::filesystem::remove(file);
}

TEST(Hydra, InstancesAndSubsetsAreTheImageOfTheirFile) {
    compare_text(instanced, "instanced");
}

TEST(Hydra, NestedInstancersAreTheImageOfTheirFile) {
    compare_text(nested, "nested");
}

TEST(HydraAssets, VolumesAreTheImageOfTheirFile) {
    const std::filesystem::path grid =
        test_assets() / "openusd/imaging/testUsdImagingGLVdbVolume/smoke_000002.vdb";
    if (!std::filesystem::exists(grid)) GTEST_SKIP() << "no assets";
    compare_text(fmt::format(R"usda(#usda 1.0
def Camera "Cam"
{{
    float focalLength = 24
    float2 clippingRange = (0.1, 100000)
    double3 xformOp:translate = (0, 0, 30)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Volume "Smoke"
{{
    rel field:density = </Smoke/Density>
    def OpenVDBAsset "Density"
    {{
        asset filePath = @{}@
        token fieldName = "density"
    }}
}}
def DistantLight "Sun"
{{
    float inputs:intensity = 2
}}
def DomeLight "Sky"
{{
    float inputs:intensity = 0.5
}}
)usda",
                             std::filesystem::canonical(grid).string()),
                 "volume");
}

TEST(Hydra, EndsWhileItRenders) {
    HostSettings settings = quick();
    settings.spp = 1 << 16;
    for (int i = 0; i < 20; ++i) {
        Host host(room_stage(), Frontend::SceneDelegate, SdfPath("/Cam"), 64, 48, settings);
        host.step();
        EXPECT_FALSE(host.is_converged());
    }
}

TEST(Hydra, ShapesAndLightsAreTheImageOfTheirFile) {
    compare_text(shapes, "shapes");
}

/// A stage for edits.
UsdStageRefPtr room_stage() {
    const UsdStageRefPtr stage = UsdStage::CreateInMemory();
    UsdGeomCamera camera = UsdGeomCamera::Define(stage, SdfPath("/Cam"));
    UsdGeomXformCommonAPI(camera).SetTranslate(GfVec3d(0, 1, 5));
    UsdGeomMesh floor = UsdGeomMesh::Define(stage, SdfPath("/Floor"));
    floor.CreatePointsAttr(VtValue(
        VtVec3fArray{GfVec3f(-3, 0, 3), GfVec3f(3, 0, 3), GfVec3f(3, 0, -3), GfVec3f(-3, 0, -3)}));
    floor.CreateFaceVertexCountsAttr(VtValue(VtIntArray{4}));
    floor.CreateFaceVertexIndicesAttr(VtValue(VtIntArray{0, 1, 2, 3}));
    floor.CreateSubdivisionSchemeAttr(VtValue(UsdGeomTokens->none));
    UsdGeomMesh slab = UsdGeomMesh::Define(stage, SdfPath("/Slab"));
    slab.CreatePointsAttr(VtValue(VtVec3fArray{GfVec3f(-1, 0, -1), GfVec3f(1, 0, -1),
                                               GfVec3f(1, 1.5, -1), GfVec3f(-1, 1.5, -1)}));
    slab.CreateFaceVertexCountsAttr(VtValue(VtIntArray{4}));
    slab.CreateFaceVertexIndicesAttr(VtValue(VtIntArray{0, 1, 2, 3}));
    slab.CreateSubdivisionSchemeAttr(VtValue(UsdGeomTokens->none));
    const UsdShadeMaterial material = UsdShadeMaterial::Define(stage, SdfPath("/Mat"));
    UsdShadeShader shader = UsdShadeShader::Define(stage, SdfPath("/Mat/Surface"));
    shader.CreateIdAttr(VtValue(TfToken("UsdPreviewSurface")));
    shader.CreateInput(TfToken("roughness"), SdfValueTypeNames->Float).Set(0.5f);
    shader.CreateInput(TfToken("diffuseColor"), SdfValueTypeNames->Color3f)
        .Set(GfVec3f(0.5f, 0.25f, 0.125f));
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), TfToken("surface"));
    UsdShadeMaterialBindingAPI::Apply(slab.GetPrim()).Bind(material);
    UsdLuxSphereLight key = UsdLuxSphereLight::Define(stage, SdfPath("/Key"));
    key.CreateIntensityAttr(VtValue(10.0f));
    UsdGeomXformCommonAPI(key).SetTranslate(GfVec3d(1, 3, 2));
    return stage;
}

using Edit = void (*)(UsdStage&, double);

const std::vector<Edit>& edits() {
    static const std::vector<Edit> list = {
        [](UsdStage& s, double u) {
            UsdGeomXformCommonAPI(s.GetPrimAtPath(SdfPath("/Cam")))
                .SetTranslate(GfVec3d(u - 0.5, 1, 5));
        },
        [](UsdStage& s, double u) {
            UsdLuxSphereLight(s.GetPrimAtPath(SdfPath("/Key")))
                .GetIntensityAttr()
                .Set(float(20 * u));
        },
        [](UsdStage& s, double u) {
            UsdGeomXformCommonAPI(s.GetPrimAtPath(SdfPath("/Key"))).SetTranslate(GfVec3d(u, 3, 2));
        },
        [](UsdStage& s, double u) {
            UsdShadeShader(s.GetPrimAtPath(SdfPath("/Mat/Surface")))
                .GetInput(TfToken("roughness"))
                .Set(float(u));
        },
        [](UsdStage& s, double u) {
            UsdGeomXformCommonAPI(s.GetPrimAtPath(SdfPath("/Slab"))).SetTranslate(GfVec3d(u, 0, 0));
        },
        [](UsdStage& s, double u) {
            UsdGeomMesh(s.GetPrimAtPath(SdfPath("/Slab")))
                .GetPointsAttr()
                .Set(VtVec3fArray{GfVec3f(-1, 0, -1), GfVec3f(1, 0, -1),
                                  GfVec3f(1, 1 + float(u), -1), GfVec3f(-1, 1.5, -1)});
        },
        [](UsdStage& s, double u) {
            UsdGeomImageable slab(s.GetPrimAtPath(SdfPath("/Slab")));
            u < 0.5 ? slab.MakeVisible() : slab.MakeInvisible();
        },
        [](UsdStage& s, double u) {
            UsdGeomMesh(s.GetPrimAtPath(SdfPath("/Floor")))
                .CreateDisplayColorPrimvar(UsdGeomTokens->constant)
                .Set(VtVec3fArray{GfVec3f(float(u), 0.5f, 0.5f)});
        },
        [](UsdStage& s, double u) {
            const SdfPath path("/Extra");
            if (u < 0.5) {
                s.RemovePrim(path);
                return;
            }
            UsdGeomMesh extra = UsdGeomMesh::Define(s.GetPrimAtPath(SdfPath("/")).GetStage(), path);
            extra.CreatePointsAttr(VtValue(
                VtVec3fArray{GfVec3f(-2, 0, 0), GfVec3f(-1, 0, 0), GfVec3f(-1.5, float(u), 0)}));
            extra.CreateFaceVertexCountsAttr(VtValue(VtIntArray{3}));
            extra.CreateFaceVertexIndicesAttr(VtValue(VtIntArray{0, 1, 2}));
            extra.CreateSubdivisionSchemeAttr(VtValue(UsdGeomTokens->none));
        },
        [](UsdStage& s, double u) {
            const SdfPath path("/Fill");
            if (u < 0.5) {
                s.RemovePrim(path);
                return;
            }
            UsdLuxSphereLight fill =
                UsdLuxSphereLight::Define(s.GetPrimAtPath(SdfPath("/")).GetStage(), path);
            fill.CreateIntensityAttr(VtValue(float(u)));
            UsdGeomXformCommonAPI(fill).SetTranslate(GfVec3d(-2, 2, 1));
        },
    };
    return list;
}

/// How many random sequences: $VELATURA_HYDRA_SEQUENCES, else a few.
int sequence_count() {
    const char* const text = std::getenv("VELATURA_HYDRA_SEQUENCES");
    return text ? std::atoi(text) : 40;
}

TEST(HydraEdits, EndInTheImageOfTheFinalStage) {
    HostSettings settings = quick();
    settings.spp = 1;
    std::mt19937 random(11);
    std::uniform_real_distribution<double> number(0.0, 1.0);
    const SdfPath camera("/Cam");
    for (const Frontend frontend : {Frontend::SceneDelegate, Frontend::SceneIndex}) {
        const UsdStageRefPtr stage = room_stage();
        Host host(stage, frontend, camera, 16, 12, settings);
        host.finish();
        for (int i = 0; i < sequence_count(); ++i) {
            const int count = 1 + int(4 * number(random));
            std::string history;
            for (int k = 0; k < count; ++k) {
                const size_t edit = size_t(double(edits().size()) * number(random));
                edits()[edit](*stage, number(random));
                history += fmt::format("{} ", edit);
                // Some are interrupted, some not
                if (number(random) < 0.5) host.step();
                if (number(random) < 0.3) host.finish();
            }
            host.finish();
            Host fresh(stage, frontend, camera, 16, 12, settings);
            fresh.finish();
            ASSERT_EQ(difference(host.read("color").floats, fresh.read("color").floats).pixels, 0u)
                << name_of(frontend) << ", sequence " << i << ": " << history;
        }
    }
}

// The finest stored family, folded in its order, is the beauty
TEST(HydraAovs, LayersSumToTheBeauty) {
    const std::string file = std::string(VELATURA_SCENES) + "/cornell/cornell.usda";
    const UsdStageRefPtr stage = UsdStage::Open(file);
    const std::vector<std::string> bounces = {"b0", "b1", "b2", "b3", "b4", "tail"};
    std::vector<std::string> aovs = {"color"};
    aovs.insert(aovs.end(), bounces.begin(), bounces.end());
    Host host(stage, Frontend::SceneDelegate, SdfPath("/World/Camera"), width, height, quick(),
              aovs);
    host.finish();
    const AovImage color = host.read("color");
    std::vector<float> sum(color.floats.size(), 0.0f);
    bool has_light = false;
    for (const std::string& bounce : bounces) {
        const AovImage layer = host.read(bounce);
        ASSERT_EQ(layer.components, 3u);
        for (size_t i = 0; i < layer.floats.size(); ++i) {
            sum[4 * (i / 3) + i % 3] += layer.floats[i];
            has_light = has_light || layer.floats[i] > 0.0f;
        }
    }
    EXPECT_TRUE(has_light);
    for (size_t i = 0; i < sum.size(); ++i)
        if (i % 4 != 3) {
            ASSERT_EQ(sum[i], color.floats[i]) << i;
        }
}

TEST(HydraAovs, AreWhatTheirNamesSay) {
    const UsdStageRefPtr stage = room_stage();
    const std::vector<std::string> aovs = {
        "color",  "depth",  "cameraDepth", "primId", "instanceId", "elementId",
        "normal", "Neye",   "P",           "albedo", "Z",          "C_Key",
        "b1",     "b1_Key", "U_Key",       "S_Key",  "lpe:C.*",    "nonsense"};
    Host host(stage, Frontend::SceneDelegate, SdfPath("/Cam"), 32, 24, quick(), aovs);
    host.finish();
    const AovImage prims = host.read("primId"), depth = host.read("depth"),
                   camera_depth = host.read("cameraDepth"), z = host.read("Z"),
                   elements = host.read("elementId"), beauty = host.read("color"),
                   all = host.read("lpe:C.*"), nonsense = host.read("nonsense");
    size_t hits = 0;
    for (size_t i = 0; i < prims.ints.size(); ++i) {
        EXPECT_EQ(nonsense.floats[3 * i], 0.0f);
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(all.floats[3 * i + c], beauty.floats[4 * i + c],
                        2e-3f * (1.0f + beauty.floats[4 * i + c]));
        if (prims.ints[i] < 0) {
            EXPECT_EQ(depth.floats[i], 1.0f);
            continue;
        }
        ++hits;
        const std::string path = host.index().GetRprimPathFromPrimId(prims.ints[i]).GetString();
        EXPECT_TRUE(path == "/Floor" || path == "/Slab") << path;
        EXPECT_EQ(elements.ints[i], 0);
        EXPECT_GT(depth.floats[i], 0.0f);
        EXPECT_LT(depth.floats[i], 1.0f);
        EXPECT_GT(camera_depth.floats[i], 0.0f);
        // Along an edge the mean depth is another one
        if (z.floats[i] > 0.0f && path == "/Slab") {
            EXPECT_NEAR(camera_depth.floats[i], z.floats[i], 2.0f);
        }
    }
    EXPECT_GT(hits, 50u);
    for (const char* const light :
         {"C_Key", "b1", "b1_Key", "U_Key", "albedo", "normal", "Neye", "P"}) {
        float largest = 0;
        for (const float v : host.read(light).floats) largest = std::max(largest, std::abs(v));
        EXPECT_GT(largest, 0.0f) << light;
    }
}

TEST(Hydra, PausesStopsAndRestarts) {
    HostSettings settings = quick();
    settings.spp = 1 << 14;
    Host host(room_stage(), Frontend::SceneDelegate, SdfPath("/Cam"), 32, 24, settings);
    HdRenderDelegate& delegate = host.delegate();
    EXPECT_TRUE(delegate.IsPauseSupported() && delegate.IsStopSupported());
    host.step();
    EXPECT_TRUE(delegate.Pause());
    EXPECT_TRUE(delegate.IsPaused());
    EXPECT_TRUE(delegate.Resume());
    EXPECT_FALSE(delegate.IsPaused());
    EXPECT_TRUE(delegate.Stop(true));
    EXPECT_TRUE(delegate.IsStopped());
    EXPECT_FALSE(host.is_converged());
    delegate.SetRenderSetting(HdRenderSettingsTokens->convergedSamplesPerPixel, VtValue(2));
    host.finish();
    EXPECT_FALSE(delegate.IsStopped());
    const VtDictionary stats = delegate.GetRenderStats();
    EXPECT_EQ(stats.GetValueAtPath("fractionDone")->Get<double>(), 1.0);
    EXPECT_EQ(stats.GetValueAtPath("numCompletedSamples")->Get<int>(), 2);
    EXPECT_EQ(delegate.GetRenderSettingDescriptors().size(), 10u);
}

}  // namespace
}  // namespace velatura::hydra
