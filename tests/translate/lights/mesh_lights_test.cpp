// SPDX-License-Identifier: Apache-2.0
#include "translate/color/blackbody.h"
#include "translate/support.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::translate::lights {

namespace {

const std::string materials = R"(
def Material "Glow" {
    token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (0.5, 0.25, 1)
        token outputs:surface
    }
}
def Material "Dull" {
    token outputs:surface.connect = </Dull/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
)";

/// A quad with these schemas applied and this in its body.
std::string lamp(const std::string& schemas, const std::string& body) {
    std::string text = quad("Lamp", body);
    text.insert(text.find('{'), "(prepend apiSchemas = [" + schemas + "]) ");
    return text;
}

void translate_lamp(const std::string& schemas, const std::string& body, Translated& t) {
    translate_text(camera() + materials + lamp(schemas, body), t);
    EXPECT_EQ(t.error, "") << t.error_message;
}

}  // namespace

TEST(MeshLights, ReadTheInputsOfLightApi) {
    Translated t;
    translate_lamp("\"MeshLightAPI\", \"ShapingAPI\"", R"(
    float inputs:intensity = 3
    float inputs:exposure = 1
    color3f inputs:color = (1, 0.5, 0.25)
    bool inputs:enableColorTemperature = 1
    float inputs:colorTemperature = 3000
    bool inputs:normalize = 1
    float inputs:diffuse = 0.5
    float inputs:specular = 0.25
    float inputs:shaping:cone:angle = 30
    string velatura:light:group = "key"
    double3 xformOp:translate = (1, 2, -3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)",
                   t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    ASSERT_EQ(t.scene.mesh_lights.size(), 1u);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    EXPECT_TRUE(t.scene.lights.empty());
    EXPECT_EQ(t.scene.shapes[0].light, 0u);
    const scene::MeshLight& light = t.scene.mesh_lights[0];
    const Vec3d expected = Vec3d(1, 0.5, 0.25) * color::blackbody_rgb(3000) * 6.0;
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(light.Le[c], float(expected[c]));
    EXPECT_TRUE(light.is_normalized);
    EXPECT_EQ(light.diffuse_multiplier, 0.5f);
    EXPECT_EQ(light.specular_multiplier, 0.25f);
    EXPECT_TRUE(light.shaping.is_active);
    EXPECT_EQ(light.shaping.cone_angle_deg, 30.0f);
    EXPECT_EQ(light.parent_from_light[3][2], -3.0);
    EXPECT_EQ(light.name, "/Lamp");
    ASSERT_EQ(t.scene.groups.size(), 2u);
    EXPECT_EQ(t.scene.groups[light.group].name, "key");
    EXPECT_EQ(t.scene.groups[light.group].prims, std::vector<std::string>{"/Lamp"});
    EXPECT_FALSE(t.scene.groups[light.group].is_environment);
}

TEST(MeshLights, FollowTheirMaterialAsTheModeSays) {
    const struct {
        const char* schema;
        const char* body;
        bool is_tinted, shows_material;
    } cases[] = {
        {"\"MeshLightAPI\"", "rel material:binding = </Glow>", true, true},
        {"\"LightAPI\"", "rel material:binding = </Glow>", false, false},
        {"\"MeshLightAPI\"",
         "rel material:binding = </Glow>\nuniform token light:materialSyncMode = \"independent\"",
         false, true},
        {"\"MeshLightAPI\"",
         "rel material:binding = </Glow>\n"
         "uniform token light:materialSyncMode = \"noMaterialResponse\"",
         false, false},
        {"\"LightAPI\"",
         "rel material:binding = </Glow>\n"
         "uniform token light:materialSyncMode = \"materialGlowTintsLight\"",
         true, true},
        {"\"MeshLightAPI\"", "", false, false},  // without a material there is nothing to follow
    };

    for (const auto& c : cases) {
        Translated t;
        translate_lamp(std::string(c.schema) + ", \"MaterialBindingAPI\"", c.body, t);
        ASSERT_EQ(t.scene.mesh_lights.size(), 1u) << c.schema << c.body;
        EXPECT_EQ(t.diagnostics.warning_count(), 0u) << c.schema << c.body;
        EXPECT_EQ(t.scene.mesh_lights[0].is_tinted_by_emission, c.is_tinted) << c.schema << c.body;
        EXPECT_EQ(t.scene.mesh_lights[0].shows_material, c.shows_material) << c.schema << c.body;
        const scene::Material& material = t.scene.materials[t.scene.shapes[0].material];
        if (c.shows_material) {
            EXPECT_EQ(material.name, "/Glow");
        } else {
            EXPECT_EQ(material.diffuse_color.value, Rgb(0.0f));
            EXPECT_FALSE(material.has_specular);
            EXPECT_EQ(material.emissive_color.value, Rgb(0.0f));
        }
    }
}

TEST(MeshLights, SubsetsGiveTheGlowFaceByFace) {
    const std::string body = R"(
    rel material:binding = </Dull>
    def GeomSubset "Part" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token familyName = "materialBind"
        uniform token elementType = "face"
        int[] indices = [0]
        rel material:binding = </Glow>
    }
)";
    Translated t;
    translate_lamp("\"MeshLightAPI\", \"MaterialBindingAPI\"", body, t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    ASSERT_EQ(t.scene.mesh_lights.size(), 1u);
    EXPECT_EQ(t.mesh(0).face_materials.size(), 1u);
    EXPECT_TRUE(t.scene.mesh_lights[0].is_tinted_by_emission);

    Translated black;
    translate_lamp("\"LightAPI\", \"MaterialBindingAPI\"", body, black);
    EXPECT_TRUE(black.mesh(0).face_materials.empty());
}

TEST(MeshLights, AnyGprimCanBeOne) {
    Translated t;
    translate_text(camera() +
                       "def Sphere \"S\" (prepend apiSchemas = [\"LightAPI\"]) {\n"
                       "bool inputs:normalize = 1\n}\n",
                   t);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
    ASSERT_EQ(t.scene.mesh_lights.size(), 1u);
    EXPECT_EQ(t.scene.shapes[0].light, 0u);
    EXPECT_EQ(t.scene.groups[0].name, "S");
}

TEST(MeshLights, InstancesShareTheLightOfTheirPrototype) {
    const std::string prototype =
        "class Xform \"Proto\" {\n" + lamp("\"MeshLightAPI\"", "") + "}\n";
    const auto instance = [](const std::string& name, const std::string& at) {
        return "def Xform \"" + name + R"(" (instanceable = true
    inherits = </Proto>) {
    double3 xformOp:translate = )" +
               at + R"(
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";
    };
    Translated t;
    translate_text(camera() + prototype + instance("A", "(1, 0, 0)") + instance("B", "(2, 0, 0)"),
                   t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    ASSERT_EQ(t.scene.mesh_lights.size(), 1u);
    EXPECT_EQ(t.scene.prototypes[0].shapes[0].light, 0u);
    ASSERT_EQ(t.scene.groups.size(), 2u);
    EXPECT_EQ(t.scene.groups[t.scene.mesh_lights[0].group].name, "Lamp");

    // A point instancer that places nothing has no row in the mixer
    Translated none;
    translate_text(camera() +
                       "def PointInstancer \"P\" {\n"
                       "int[] protoIndices = []\npoint3f[] positions = []\n"
                       "rel prototypes = </P/Lamp>\n" +
                       lamp("\"MeshLightAPI\"", "") + "}\n",
                   none);
    EXPECT_EQ(none.scene.groups.size(), 1u);
    EXPECT_EQ(none.count("no-lights"), 0u);
}

TEST(MeshLights, FlattenedInstancesKeepTheAxisOfTheirShaping) {
    Translated t;
    translate_text(camera() +
                       "def PointInstancer \"P\" {\n"
                       "int[] protoIndices = [0]\npoint3f[] positions = [(0, 0, -5)]\n"
                       "float3[] scales = [(1, 1, 0)]\nrel prototypes = </P/Lamp>\n" +
                       lamp("\"MeshLightAPI\", \"ShapingAPI\"", "float inputs:shaping:focus = 2") +
                       "}\n",
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    ASSERT_NE(t.scene.shapes[0].light, scene::none);
    const scene::MeshLight& light = t.scene.mesh_lights[t.scene.shapes[0].light];
    EXPECT_EQ(light.parent_from_light[3][2], -5.0);
    EXPECT_EQ(light.parent_from_light[2][2], 0.0);
    EXPECT_EQ(t.scene.groups[light.group].name, "Lamp");
}

TEST(MeshLights, SayWhatTheyCannot) {
    const auto expect_warning = [](const std::string& text, const std::string& code) {
        Translated t;
        translate_text(camera() + materials + text, t);
        EXPECT_EQ(t.count(code), 1u) << text;
        EXPECT_EQ(t.count("no-lights"), 0u) << text;
    };
    expect_warning(
        lamp("\"MeshLightAPI\", \"MaterialBindingAPI\"", "rel material:binding = </Dull>"),
        "mesh-light-without-glow");
    expect_warning(lamp("\"MeshLightAPI\"", "float inputs:intensity = -1"), "bad-light-value");
    expect_warning(lamp("\"MeshLightAPI\", \"MaterialBindingAPI\"",
                        "rel material:binding = </Glow>\n"
                        "uniform token light:materialSyncMode = \"nonsense\""),
                   "unsupported-light-input");
    expect_warning(lamp("\"MeshLightAPI\"", "asset inputs:shaping:ies:file = @a.ies@"),
                   "ies-unreadable");
    expect_warning("def Volume \"V\" (prepend apiSchemas = [\"VolumeLightAPI\"]) {}\n",
                   "unsupported-light");
    expect_warning(lamp("\"VolumeLightAPI\"", ""), "unsupported-light");
    // Neither do prims without geometry, whatever lies below them
    for (const char* type : {"Xform ", "Scope ", ""}) {
        expect_warning(
            std::string("def ") + type + "\"X\" (prepend apiSchemas = [\"LightAPI\"]) {}\n",
            "unsupported-light");
    }
    expect_warning("def Points \"P\" (prepend apiSchemas = [\"LightAPI\"]) {}\n",
                   "unsupported-light");
}

}  // namespace velatura::translate::lights
