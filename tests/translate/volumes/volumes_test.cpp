// SPDX-License-Identifier: Apache-2.0
// Volume prims: fields, what they mean, where they stand.
#include "translate/support.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::translate::volumes {
namespace {

std::string field(const std::string& name, const std::string& more = "") {
    return "def OpenVDBAsset \"" + name + "\" {\n asset filePath = @" + name +
           ".vdb@\n token fieldName = \"grid_" + name + "\"\n" + more + "\n}\n";
}

std::string smoke(const std::string& more = "",
                  const std::string& fields = "rel field:density = </Smoke/D>\n") {
    return camera() +
           "def DistantLight \"Sun\" {\n}\ndef Volume \"Smoke\" (prepend apiSchemas = "
           "[\"MaterialBindingAPI\"]) {\n" +
           fields + more + "\n" + field("D") + "}\n";
}

void expect_one(const Translated& t) {
    for (const Diagnostic& d : t.diagnostics.all())
        if (d.severity != Severity::Note) ADD_FAILURE() << t.diagnostics.format(d);
    ASSERT_EQ(t.scene.volumes.size(), 1u);
}

}  // namespace

TEST(Volumes, HaveFields) {
    Translated t;
    translate_text(smoke("double3 xformOp:translate = (1, 2, 3)\nuniform token[] xformOpOrder = "
                         "[\"xformOp:translate\"]\nint x = 1"),
                   t);
    expect_one(t);
    const scene::Volume& v = t.scene.volumes[0];
    EXPECT_EQ(v.name, "/Smoke");
    EXPECT_EQ(
        Vec3d(v.render_from_volume[3][0], v.render_from_volume[3][1], v.render_from_volume[3][2]),
        Vec3d(1, 2, 3));
    ASSERT_EQ(v.density, 0u);
    EXPECT_EQ(t.scene.volume_fields[0].authored, "D.vdb");
    EXPECT_EQ(t.scene.volume_fields[0].grid, "grid_D");
    EXPECT_EQ(t.scene.volume_fields[0].voxels, nullptr);
    EXPECT_EQ(v.emission, scene::none);
    EXPECT_EQ(v.optics.density_scale, 1.0f);
    EXPECT_EQ(v.optics.albedo, Rgb(0.5f));
    EXPECT_EQ(v.optics.blackbody, 0.0f) << "nothing is warm";
}

TEST(Volumes, OfALevelSetAreSurfaces) {
    const std::string glass =
        "def Material \"Glass\" {\n token outputs:surface.connect = </Glass/S.outputs:surface>\n"
        "def Shader \"S\" {\n uniform token info:id = \"UsdPreviewSurface\"\n"
        "float inputs:opacity = 0\n token outputs:surface\n}\n}\n";
    const auto surface = [&](const std::string& more, const std::string& of_field) {
        return camera() +
               "def DistantLight \"Sun\" {\n}\ndef Volume \"Stone\" (prepend apiSchemas = "
               "[\"MaterialBindingAPI\"]) {\nrel field:shape = </Stone/D>\n"
               "rel material:binding = </Glass>\nbool doubleSided = 1\n"
               "color3f[] primvars:displayColor = [(1, 0, 0)]\n" +
               more + field("D", of_field) + field("T") + "}\n" + glass;
    };
    Translated t;
    translate_text(surface("", "token fieldClass = \"levelSet\""), t);
    expect_one(t);
    const scene::Volume& v = t.scene.volumes[0];
    EXPECT_TRUE(scene::is_level_set(v, t.scene.volume_fields));
    EXPECT_EQ(v.surface.material, 0u);
    EXPECT_TRUE(v.surface.double_sided);
    EXPECT_EQ(v.surface_primvars.size(), 1u);
    // Whatever else it has
    Translated warm;
    translate_text(
        surface("rel field:temperature = </Stone/T>\n", "token fieldClass = \"levelSet\""), warm);
    EXPECT_EQ(warm.count("volume-field"), 1u);
    EXPECT_EQ(warm.scene.volumes[0].temperature, scene::none);
    // The file may know better, if it is not said to be fog
    Translated open;
    translate_text(surface("", ""), open);
    EXPECT_EQ(open.scene.volume_fields[0].kind, scene::GridKind::AsStored);
    EXPECT_EQ(open.scene.volumes[0].surface.material, 0u);
    Translated fog;
    translate_text(surface("", "token fieldClass = \"fogVolume\""), fog);
    EXPECT_EQ(fog.scene.volume_fields[0].kind, scene::GridKind::Densities);
    EXPECT_EQ(fog.scene.volumes[0].surface.material, scene::none);
}

TEST(Volumes, HaveOpticsOfTheirOwn) {
    Translated t;
    translate_text(
        smoke(
            "float velatura:volume:densityScale = 3\ncolor3f velatura:volume:albedo = (1, 0.5, "
            "0)\nfloat velatura:volume:anisotropy = -0.5\n"
            "color3f velatura:volume:extinctionColor = (1, 2, 4)\nfloat "
            "velatura:volume:emissionScale = 2\ncolor3f velatura:volume:emissionColor = (1, 2, 3)"),
        t);
    expect_one(t);
    const scene::VolumeOptics& o = t.scene.volumes[0].optics;
    EXPECT_EQ(o.density_scale, 3.0f);
    EXPECT_EQ(o.albedo, Rgb(1.0f, 0.5f, 0.0f));
    EXPECT_EQ(o.anisotropy, -0.5f);
    EXPECT_EQ(o.extinction_color, Rgb(1.0f, 2.0f, 4.0f));
    EXPECT_EQ(o.emission, Rgb(2.0f, 4.0f, 6.0f));
}

TEST(Volumes, TakeTheirColorFromDisplayColor) {
    Translated t;
    translate_text(smoke("color3f[] primvars:displayColor = [(0.25, 0.5, 1)]"), t);
    expect_one(t);
    EXPECT_EQ(t.scene.volumes[0].optics.albedo, Rgb(0.25f, 0.5f, 1.0f));
}

// More than 1 would make light at every scattering
TEST(Volumes, TakeOnlyAnAlbedoFromDisplayColor) {
    Translated t;
    translate_text(smoke("color3f[] primvars:displayColor = [(4, -1, nan)]"), t);
    expect_one(t);
    EXPECT_EQ(t.scene.volumes[0].optics.albedo, Rgb(1.0f, 0.0f, 0.5f));
}

TEST(Volumes, KnowFieldsByName) {
    Translated t;
    translate_text(camera() +
                       "def Volume \"Fire\" {\n rel field:flame = </Fire/F>\n rel "
                       "field:temperature = </Fire/T>\n rel field:Cd = </Fire/C>\n rel "
                       "field:density = </Fire/D>\n rel field:vel = </Fire/V>\n" +
                       field("F") + field("T") + field("C") + field("D", "int fieldIndex = 2") +
                       field("V") + "}\n",
                   t);
    ASSERT_EQ(t.scene.volumes.size(), 1u);
    const scene::Volume& v = t.scene.volumes[0];
    const auto grid = [&](uint32_t i) { return t.scene.volume_fields[i].grid; };
    EXPECT_EQ(grid(v.emission), "grid_F");
    EXPECT_EQ(grid(v.temperature), "grid_T");
    EXPECT_EQ(grid(v.color), "grid_C");
    EXPECT_EQ(grid(v.density), "grid_D");
    EXPECT_EQ(t.scene.volume_fields[v.density].index, 2);
    EXPECT_EQ(v.optics.blackbody, 1.0f);
    EXPECT_EQ(v.optics.blackbody_colors.size(), 101u);
    EXPECT_EQ(t.count("volume-field"), 1u) << "vel";
    EXPECT_EQ(t.scene.volume_fields.size(), 4u);
    EXPECT_EQ(t.count("no-lights"), 0u) << "fire is light";
}

TEST(Volumes, AskTheInputsOfTheirShader) {
    Translated t;
    translate_text(smoke("rel material:binding = </Mat>\nfloat primvars:thickness = 4\nfloat "
                         "primvars:albedo = 0.25\nrel field:warmth = </Smoke/D>") +
                       R"usda(
def Material "Mat"
{
    token outputs:volume.connect = </Mat/V.outputs:volume>
    def Shader "V"
    {
        uniform asset info:glslfx:sourceAsset = @v.glslfx@
        float inputs:density.connect = </Mat/Density.outputs:result>
        float inputs:heat.connect = </Mat/Warmth.outputs:result>
        float inputs:densityScale.connect = </Mat/Scale.outputs:result>
        float inputs:albedo.connect = </Mat/Albedo.outputs:result>
        float inputs:heatScale = 5
        float inputs:wobble = 1
        token outputs:volume
    }
    def Shader "Density"
    {
        uniform token info:id = "HwFieldReader_float"
        token inputs:fieldname = "density"
        float outputs:result
    }
    def Shader "Warmth"
    {
        uniform token info:id = "HwFieldReader_float"
        token inputs:fieldname = "warmth"
        float outputs:result
    }
    def Shader "Scale"
    {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "thickness"
        float outputs:result
    }
    def Shader "Albedo"
    {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "albedo"
        float outputs:result
    }
}
)usda",
                   t);
    ASSERT_EQ(t.scene.volumes.size(), 1u);
    const scene::Volume& v = t.scene.volumes[0];
    EXPECT_NE(v.density, scene::none);
    EXPECT_NE(v.emission, scene::none);
    EXPECT_EQ(v.optics.density_scale, 4.0f);
    EXPECT_EQ(v.optics.albedo, Rgb(0.25f));
    EXPECT_EQ(v.optics.emission, Rgb(5.0f, 1.5f, 0.25f));
    EXPECT_EQ(t.count("unsupported-shader"), 1u);
    EXPECT_EQ(t.count("unknown-shader-input"), 1u);
}

TEST(Volumes, StandWhereInstancesPutThem) {
    Translated t;
    translate_text(camera() + R"usda(
def Xform "Proto" (instanceable = true) {
    def Volume "Smoke" {
        rel field:density = </Proto/Smoke/D>
        double3 xformOp:translate = (0, 0, -5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def OpenVDBAsset "D" {
            asset filePath = @a.vdb@
        }
    }
}
def Xform "A" (instanceable = true
    references = </Proto>) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda",
                   t);
    ASSERT_EQ(t.scene.volumes.size(), 2u);
    EXPECT_EQ(t.scene.volume_fields.size(), 1u);
    double x = 0;
    for (const scene::Volume& v : t.scene.volumes) {
        x += v.render_from_volume[3][0];
        EXPECT_EQ(v.render_from_volume[3][2], -5.0);
    }
    EXPECT_EQ(x, 10.0);
}

TEST(Volumes, SayWhatTheyLeaveOut) {
    const auto warns = [](const std::string& text, const char* code, size_t volumes,
                          size_t count = 1) {
        Translated t;
        translate_text(text, t);
        EXPECT_EQ(t.count(code), count) << text;
        EXPECT_EQ(t.scene.volumes.size(), volumes) << text;
    };
    warns(smoke("", ""), "volume-field", 0);
    warns(smoke("", "rel field:density = </Smoke/Nobody>\n"), "volume-field", 0, 2);
    warns(smoke("float velatura:volume:albedo = 3"), "volume-optics", 1);
    warns(smoke("float velatura:volume:anisotropy = nan"), "volume-optics", 1);
    warns(smoke("float velatura:volume:wobble = 3"), "unknown-attribute", 1);
    warns(smoke("double3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = "
                "[\"xformOp:scale\"]"),
          "bad-transform", 0);
    warns(smoke("rel material:binding = </Mat>") + "def Material \"Mat\" {\n}\n",
          "unsupported-material", 1);
    warns(camera() + "def Volume \"Smoke\" {\n rel field:density = </Smoke/D>\n" +
              field("D",
                    "double3 xformOp:translate = (1, 0, 0)\nuniform token[] xformOpOrder = "
                    "[\"xformOp:translate\"]") +
              "}\n",
          "volume-field", 1);
}

}  // namespace velatura::translate::volumes
