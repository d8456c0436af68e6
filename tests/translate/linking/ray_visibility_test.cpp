// SPDX-License-Identifier: Apache-2.0
// Visibility to kinds of rays and mattes, by the attributes of several renderers. Oracle: their
// documentation, and inheritance of constant primvars as UsdGeomPrimvarsAPI has it.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace velatura::translate::linking {

namespace {

using scene::RayKind;

constexpr std::pair<RayKind, char> letters[] = {
    {RayKind::Camera, 'c'},     {RayKind::Shadow, 's'},
    {RayKind::Diffuse, 'd'},    {RayKind::DiffuseTransmission, 't'},
    {RayKind::Reflection, 'r'}, {RayKind::Refraction, 'f'},
    {RayKind::Volume, 'v'}};

/// Kinds of rays that see geometry of the class, a letter each, and M for a matte.
std::string seen(const scene::Scene& scene, scene::LinkClass c) {
    std::string text;
    for (const auto& [kind, letter] : letters) {
        const scene::LinkSetId set = scene.linking.visible_to(kind);
        if (set == scene::none || scene.linking.sets[set].holds(c)) text += letter;
    }
    const scene::LinkSetId mattes = scene.linking.mattes;
    if (mattes != scene::none && scene.linking.sets[mattes].holds(c)) text += 'M';
    return text;
}

/// Of a quad with these lines, beside another one without.
std::string quad_seen(const std::string& lines, size_t warnings = 0) {
    Translated t;
    translate_text(camera() + quad("Plain") + quad("Q", lines) + "def SphereLight \"L\" {}", t);
    EXPECT_EQ(t.diagnostics.warning_count(), warnings) << lines;
    EXPECT_EQ(t.count("bad-visibility"), warnings) << lines;
    EXPECT_EQ(seen(t.scene, t.scene.shapes.at(0).link), "csdtrfv");
    return t.scene.shapes.size() < 2 ? "" : seen(t.scene, t.scene.shapes[1].link);
}

std::string arnold(const std::string& kind) {
    return "bool primvars:arnold:visibility:" + kind + " = 0\n";
}

std::string karma(const std::string& mask, size_t warnings = 0) {
    return quad_seen("string primvars:karma:object:rendervisibility = \"" + mask + "\"", warnings);
}

}  // namespace

TEST(RayVisibility, IsFullWhereNothingIsAuthored) {
    Translated t;
    translate_text(camera() + quad("Q") + "def SphereLight \"L\" {}", t);
    EXPECT_FALSE(t.scene.linking.has_ray_visibility());
    EXPECT_EQ(t.scene.linking.mattes, scene::none);
    EXPECT_TRUE(t.scene.linking.sets.empty());
    EXPECT_EQ(t.scene.lights[0].links, scene::LightLinks());
    EXPECT_TRUE(t.scene.lights[0].is_camera_visible);
}

TEST(RayVisibility, ByTheSwitchesOfArnold) {
    EXPECT_EQ(quad_seen(arnold("camera")), "sdtrfv");
    EXPECT_EQ(quad_seen(arnold("shadow")), "cdtrfv");
    EXPECT_EQ(quad_seen(arnold("diffuse_reflect")), "cstrfv");
    EXPECT_EQ(quad_seen(arnold("diffuse_transmit")), "csdrfv");
    EXPECT_EQ(quad_seen(arnold("specular_reflect")), "csdtfv");
    EXPECT_EQ(quad_seen(arnold("specular_transmit")), "csdtrv");
    EXPECT_EQ(quad_seen(arnold("volume")), "csdtrf");
    EXPECT_EQ(quad_seen(arnold("camera") + arnold("shadow")), "dtrfv");
    // AI_RAY_CAMERA is 1, SHADOW 2, DIFFUSE_TRANSMIT 4, SPECULAR_TRANSMIT 8, VOLUME 16,
    // DIFFUSE_REFLECT 32, SPECULAR_REFLECT 64, SUBSURFACE 128
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 254"), "sdtrfv");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 1"), "c");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 2"), "s");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 4"), "t");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 8"), "f");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 16"), "v");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 32"), "d");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 64"), "r");
    // A switch counts before the mask
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 2\nbool "
                        "primvars:arnold:visibility:camera = 1"),
              "cs");
}

TEST(RayVisibility, ByTheMaskOfKarma) {
    EXPECT_EQ(karma("*"), "csdtrfv");
    EXPECT_EQ(karma("primary"), "c");
    EXPECT_EQ(karma("primary,shadow"), "cs");
    EXPECT_EQ(karma("primary|shadow"), "cs");
    EXPECT_EQ(karma("-primary"), "sdtrfv");
    EXPECT_EQ(karma("-diffuse"), "csrf");
    EXPECT_EQ(karma("-diffuse,-reflect,-refract"), "cs");
    EXPECT_EQ(karma("* ^shadow"), "cdtrfv");
    EXPECT_EQ(karma("-diffuse&-reflect&-refract"), "cs");
    EXPECT_EQ(karma(""), "");
    EXPECT_EQ(karma("-primry", 1), "csdtrfv");
}

TEST(RayVisibility, ByTheAttributesOfRenderManAndOurs) {
    const std::string ri = "int primvars:ri:attributes:visibility:";
    EXPECT_EQ(quad_seen(ri + "camera = 0"), "sdtrfv");
    EXPECT_EQ(quad_seen(ri + "indirect = 0"), "cs");
    EXPECT_EQ(quad_seen(ri + "transmission = 0"), "cdtrfv");
    const std::string ours = "bool primvars:velatura:visibility:";
    EXPECT_EQ(quad_seen(ours + "camera = 0"), "sdtrfv");
    EXPECT_EQ(quad_seen(ours + "shadow = 0"), "cdtrfv");
    EXPECT_EQ(quad_seen(ours + "diffuse = 0"), "cstrfv");
    EXPECT_EQ(quad_seen(ours + "diffuseTransmission = 0"), "csdrfv");
    EXPECT_EQ(quad_seen(ours + "reflection = 0"), "csdtfv");
    EXPECT_EQ(quad_seen(ours + "refraction = 0"), "csdtrv");
    EXPECT_EQ(quad_seen(ours + "volume = 0"), "csdtrf");
    EXPECT_EQ(quad_seen(ours + "indirect = 0\n" + ours + "reflection = 1"), "csr");
    // On one prim ours count first, then Arnold's, Karma's and RenderMan's
    EXPECT_EQ(quad_seen(ours + "camera = 1\n" + arnold("camera") + arnold("shadow")), "cdtrfv");
    EXPECT_EQ(quad_seen(arnold("camera") + "string primvars:karma:object:rendervisibility = \"*\""),
              "sdtrfv");
}

TEST(RayVisibility, BadValuesAreNamedAndIgnored) {
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility:camera = 2", 1), "csdtrfv");
    EXPECT_EQ(quad_seen("int primvars:arnold:visibility = 256", 1), "csdtrfv");
    EXPECT_EQ(quad_seen("string primvars:velatura:visibility:shadow = \"off\"", 1), "csdtrfv");
    EXPECT_EQ(quad_seen("float primvars:arnold:matte = -1", 1), "csdtrfv");
}

TEST(Mattes, ByTheAttributesOfAll) {
    for (const char* line :
         {"bool primvars:velatura:matte = 1", "bool primvars:arnold:matte = 1",
          "int primvars:ri:attributes:Ri:Matte = 1", "int primvars:karma:object:holdoutmode = 1"})
        EXPECT_EQ(quad_seen(line), "csdtrfvM") << line;
    EXPECT_EQ(quad_seen("bool primvars:velatura:matte = 0\nbool primvars:arnold:matte = 1"),
              "csdtrfv");
    // Background holdouts are mattes, with a warning
    EXPECT_EQ(quad_seen("int primvars:karma:object:holdoutmode = 2", 1), "csdtrfvM");
}

TEST(RayVisibility, IsInheritedAndTheNearestPrimWins) {
    Translated t;
    translate_text(camera() + "def Xform \"G\" {\n" + arnold("camera") + arnold("shadow") +
                       "bool primvars:arnold:matte = 1\n" + quad("A") +
                       quad("B", "bool primvars:velatura:visibility:shadow = 1") +
                       quad("C",
                            "string primvars:karma:object:rendervisibility = \"-diffuse\"\n"
                            "bool primvars:arnold:matte = 0") +
                       "}\n" + quad("D"),
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 4u);
    EXPECT_EQ(seen(t.scene, t.scene.shapes[1].link), "dtrfvM");
    EXPECT_EQ(seen(t.scene, t.scene.shapes[2].link), "sdtrfvM");
    EXPECT_EQ(seen(t.scene, t.scene.shapes[3].link), "csrf");
    EXPECT_EQ(seen(t.scene, t.scene.shapes[0].link), "csdtrfv");
}

TEST(RayVisibility, GoesIntoInstancesByWhereTheyStand) {
    Translated t;
    translate_text(
        camera() + "class Xform \"Model\" {\n" + quad("A") +
            quad("B", "bool primvars:arnold:visibility:camera = 1") +
            "}\ndef Xform \"Set\" {\ndef Xform \"One\" (instanceable = true\nreferences = "
            "</Model>) {\n" +
            arnold("camera") +
            "}\ndef Xform \"Two\" (instanceable = true\nreferences = </Model>) {}\n}\n"
            "def PointInstancer \"Dots\" {\nrel prototypes = </Dots/P>\nint[] protoIndices = [0]\n"
            "point3f[] positions = [(0, 0, 0)]\n" +
            arnold("shadow") + "def Xform \"P\" {\n" + quad("A") +
            quad("B", "bool primvars:arnold:visibility:shadow = 1") + "}\n}\n",
        t);
    ASSERT_EQ(t.error, "") << t.error_message;
    std::string text;
    for (uint32_t i = 0; i < t.scene.instances.size(); ++i) {
        text += t.scene.provenance[t.scene.instances[i].provenance].prim_path + " ";
        const size_t shapes = t.scene.prototypes[t.scene.instances[i].prototype].shapes.size();
        for (uint32_t s = 0; s < shapes; ++s)
            text += seen(t.scene, scene::link_class(t.scene, i, s)) + " ";
    }
    EXPECT_EQ(text, "/Dots cdtrfv csdtrfv /Set/One sdtrfv csdtrfv /Set/Two csdtrfv csdtrfv ");
}

TEST(RayVisibility, LightsAreHiddenFromTheCameraByAttributesOfTheirOwn) {
    const auto is_seen = [](const std::string& lines, size_t warnings = 0) {
        Translated t;
        translate_text(camera() + quad("Q") + "def RectLight \"L\" {\n" + lines + "\n}", t);
        EXPECT_EQ(t.diagnostics.warning_count(), warnings) << lines;
        EXPECT_FALSE(t.scene.linking.has_ray_visibility());
        return t.scene.lights.at(0).is_camera_visible;
    };
    EXPECT_FALSE(is_seen("float primvars:arnold:camera = 0"));
    EXPECT_TRUE(is_seen("float primvars:arnold:camera = 1"));
    EXPECT_TRUE(is_seen("float primvars:arnold:camera = 0.5", 1));
    EXPECT_FALSE(is_seen("bool inputs:karma:light:renderlightgeo = 0"));
    EXPECT_FALSE(is_seen("bool karma:light:renderlightgeo = 0"));
    EXPECT_TRUE(
        is_seen("bool karma:light:renderlightgeo = 1\nint "
                "primvars:ri:attributes:visibility:camera = 0"));
    EXPECT_FALSE(is_seen("int primvars:ri:attributes:visibility:camera = 0"));
    EXPECT_FALSE(is_seen("string primvars:karma:object:rendervisibility = \"-primary\""));
    EXPECT_FALSE(is_seen("bool primvars:velatura:visibility:camera = 0"));
    EXPECT_TRUE(is_seen("bool primvars:velatura:visibility:shadow = 0"));
}

TEST(RayVisibility, JoinsShadowLinks) {
    Translated t;
    translate_text(camera() + quad("A", arnold("shadow")) + quad("B") + quad("C") +
                       "def SphereLight \"K\" { rel collection:shadowLink:excludes = </B>\n}\n"
                       "def SphereLight \"L\" {}",
                   t);
    ASSERT_EQ(t.error, "") << t.error_message;
    const auto casters = [&](size_t light) {
        std::string text;
        const scene::LinkSetId set = t.scene.lights.at(light).links.casters;
        for (size_t i = 0; i < 3; ++i)
            if (set == scene::none || t.scene.linking.sets[set].holds(t.scene.shapes[i].link))
                text += char('A' + int(i));
        return text;
    };
    EXPECT_EQ(casters(0), "C");
    EXPECT_EQ(casters(1), "BC");
    EXPECT_TRUE(scene::has_plain_shadows(t.scene, t.scene.lights[1].links));
    EXPECT_FALSE(scene::has_plain_shadows(t.scene, t.scene.lights[0].links));
}

}  // namespace velatura::translate::linking
