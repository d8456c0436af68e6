// SPDX-License-Identifier: Apache-2.0
#include "translate/color/blackbody.h"
#include "translate/lights/light_area.h"
#include "translate/support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::translate::lights {

namespace {

scene::Light light(const std::string& type, const std::string& body) {
    Translated t;
    translate_text(camera() + "def " + type + " \"L\" {\n" + body + "\n}\n", t);
    EXPECT_EQ(t.error, "");
    EXPECT_EQ(t.scene.lights.size(), 1u);
    return t.scene.lights.empty() ? scene::Light() : t.scene.lights[0];
}

const char* const scaled =
    "double3 xformOp:scale = (2, 3, 5)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]\n";

/// ∫ |n · C| over the unit sphere by the midpoint rule: area of the ellipsoid by another road.
double ellipsoid_area(const Mat4d& m) {
    const Mat3d c = cofactor_matrix(m);
    const int n = 400;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        const double z = -1 + (i + 0.5) * 2 / n, s = std::sqrt(1 - z * z);
        for (int j = 0; j < 2 * n; ++j) {
            const double phi = (j + 0.5) * pi_d / n;
            sum += (Vec3d(s * std::cos(phi), s * std::sin(phi), z) * c).length();
        }
    }
    return sum * 2 / n * pi_d / n;
}

double cylinder_area_by_quadrature(double r, double l, const Mat4d& m) {
    const Vec3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]),
        z(m[2][0], m[2][1], m[2][2]);
    const int n = 4096;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        const double t = 2 * pi_d * i / n;
        sum += (x * l).cross((z * std::cos(t) - y * std::sin(t)) * r).length();
    }
    return sum * 2 * pi_d / n;
}

}  // namespace

TEST(LightAreas, MatchClosedFormsAndQuadrature) {
    const Mat4d scale(2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 5, 0, 0, 0, 0, 1);
    const Mat4d shear(1, 0.5, 0.2, 0, -0.3, 2, 0.7, 0, 0.1, 0.4, 0.6, 0, 9, 9, 9, 1);
    EXPECT_DOUBLE_EQ(rect_area(2, 3, scale), 36.0);
    EXPECT_DOUBLE_EQ(disk_area(0.5, scale), pi_d * 1.0 * 1.5);
    EXPECT_NEAR(sphere_area(0.5, Mat4d()), pi_d, 1e-13);
    EXPECT_NEAR(cylinder_area(0.5, 2, Mat4d()), 2 * pi_d, 1e-13);
    for (const Mat4d& m : {scale, shear}) {
        // The midpoint rule is off by O(1/n²), about 1e-5 relative at n = 400
        EXPECT_NEAR(sphere_area(1, m) / ellipsoid_area(m), 1.0, 2e-5);
        EXPECT_NEAR(cylinder_area(0.7, 3, m) / cylinder_area_by_quadrature(0.7, 3, m), 1.0, 1e-12);
    }
    // Prolate spheroid (1, 1, 2): 2π(1 + 2/e·asin e), e² = 3/4
    const double e = std::sqrt(0.75);
    const Mat4d prolate(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1);
    EXPECT_NEAR(sphere_area(1, prolate), 2 * pi_d * (1 + 2 / e * std::asin(e)), 1e-12);
    // Flat: both sides of an ellipse
    const Mat4d flat(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1);
    EXPECT_NEAR(sphere_area(1, flat), 2 * pi_d * 2, 1e-7);
}

TEST(LightAreas, ScaleExactlyByPowersOfTwo) {
    const Mat4d m(1, 0.5, 0.2, 0, -0.3, 2, 0.7, 0, 0.1, 0.4, 0.6, 0, 9, 9, 9, 1);
    for (const int k : {-20, -3, 7, 20}) {
        Mat4d s = m;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) s[i][j] = std::ldexp(m[i][j], k);
        EXPECT_EQ(sphere_area(0.3, s), std::ldexp(sphere_area(0.3, m), 2 * k));
        EXPECT_EQ(cylinder_area(0.3, 2, s), std::ldexp(cylinder_area(0.3, 2, m), 2 * k));
        EXPECT_EQ(disk_area(0.3, s), std::ldexp(disk_area(0.3, m), 2 * k));
        EXPECT_EQ(rect_area(0.3, 2, s), std::ldexp(rect_area(0.3, 2, m), 2 * k));
    }
}

TEST(Lights, RadianceIsIntensityTimesExposureTimesColor) {
    const scene::Light l = light(
        "RectLight",
        "float inputs:intensity = 3\nfloat inputs:exposure = 2\n"
        "color3f inputs:color = (1, 0.5, 0.25)\nfloat inputs:width = 4\nfloat inputs:height = 2");
    EXPECT_EQ(l.Le, Rgb(12, 6, 3));
    EXPECT_EQ(l.width, 4.0f);
    EXPECT_EQ(l.kind, scene::LightKind::Rect);
}

TEST(Lights, NamesOfOldSchemasAreLeftOutAndSaid) {
    Translated t;
    // OpenUSD reads none of them since 21.02; a prim that is no light keeps its own radius
    translate_text(camera() + R"(
def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {
    float intensity = 7
    float radius = 3
    float shaping:focus = 2
}
def Sphere "S" (prepend apiSchemas = ["LightAPI"]) { double radius = 2; }
)",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    EXPECT_EQ(t.scene.lights[0].Le, Rgb(1.0f));
    EXPECT_EQ(t.scene.lights[0].radius, 0.5f);
    EXPECT_EQ(t.scene.lights[0].shaping.focus, 0.0f);
    EXPECT_EQ(t.count("old-light-attribute"), 3u);
    for (const Diagnostic& d : t.diagnostics.all()) {
        if (d.code != "old-light-attribute") continue;
        EXPECT_NE(d.message.find("expected inputs:"), std::string::npos) << d.message;
    }
}

TEST(Lights, ConnectedInputsHaveTheValueAtTheEnd) {
    Translated t;
    translate_text(camera() + R"(
def Material "rig" {
    color3f inputs:key = (0.5, 0.4, 0.3)
    float inputs:power = 4
    float inputs:wide = 6
    def Shader "noise" {
        uniform token info:id = "ND_noise2d_float"
        float outputs:out
    }
    def NodeGraph "inner" {
        float inputs:power.connect = </rig.inputs:power>
        float outputs:power.connect = </rig/inner.inputs:power>
    }
}
def DomeLight "A" { color3f inputs:color.connect = </rig.inputs:key>; }
def SphereLight "B" {
    float inputs:intensity = 9
    float inputs:intensity.connect = </rig/inner.outputs:power>
    def NodeGraph "graph" { color3f inputs:c = (0.25, 0.5, 1); }
    color3f inputs:color.connect = </B/graph.inputs:c>
}
def RectLight "C" { float inputs:width.connect = </rig.inputs:wide>; }
def RectLight "D" {
    float inputs:intensity = 3
    float inputs:intensity.connect = </rig.inputs:nothing>
}
def RectLight "E" {
    float inputs:intensity = 2
    float inputs:intensity.connect = </rig/noise.outputs:out>
}
)",
                   t);
    // The order of paths
    ASSERT_EQ(t.scene.lights.size(), 5u);
    EXPECT_EQ(t.scene.lights[0].Le, Rgb(0.5f, 0.4f, 0.3f));
    EXPECT_EQ(t.scene.lights[1].Le, Rgb(1, 2, 4)) << "4 · (0.25, 0.5, 1)";
    EXPECT_EQ(t.scene.lights[2].width, 6.0f);
    EXPECT_EQ(t.scene.lights[3].Le, Rgb(3.0f)) << "an end without a value leaves its own";
    EXPECT_EQ(t.scene.lights[4].Le, Rgb(2.0f)) << "a shader is not run";
    EXPECT_EQ(t.count("unsupported-light-shader"), 1u);
}

TEST(Lights, NamesKeepTheirLettersInLayers) {
    Translated t;
    translate_text(camera() + R"(
def SphereLight "schlüssel" {}
def SphereLight "Éclair" {}
def SphereLight "灯" {}
def SphereLight "燈" {}
def SphereLight "schluessel" {}
)",
                   t);
    std::vector<std::string> names, labels;
    for (const auto& group : t.scene.groups) {
        names.push_back(group.name);
        labels.push_back(group.label);
    }
    // Accents as German and French write without them, else code points; the scene's name beside
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"Eclair", "emissive", "schluessel", "schluessel2",
                                               "u706F", "u71C8"}));
    EXPECT_NE(std::find(labels.begin(), labels.end(), "schlüssel"), labels.end());
}

TEST(Lights, NormalizeDividesByTheWorldArea) {
    const std::string on =
        "bool inputs:normalize = 1\nfloat inputs:intensity = 1\n" + std::string(scaled);
    EXPECT_FLOAT_EQ(light("RectLight", on + "float inputs:width = 4").Le.x, float(1 / 24.0));
    EXPECT_FLOAT_EQ(light("DiskLight", on).Le.x, float(1 / (pi_d * 1.5)));
    const Mat4d m(2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 5, 0, 0, 0, 0, 1);
    // The quadrature is good to 2e-5
    EXPECT_NEAR(double(light("SphereLight", on).Le.x) * 0.25 * ellipsoid_area(m), 1.0, 2e-5);
    EXPECT_FLOAT_EQ(light("CylinderLight", on).Le.x,
                    float(1 / cylinder_area_by_quadrature(0.5, 1, m)));
}

TEST(Lights, DistantNormalizeGivesLux) {
    const double t = 0.5 * 30 * pi_d / 180;
    EXPECT_FLOAT_EQ(
        light("DistantLight", "bool inputs:normalize = 1\nfloat inputs:angle = 30").Le.x,
        float(50000 / (pi_d * std::sin(t) * std::sin(t))));
    EXPECT_FLOAT_EQ(
        light("DistantLight",
              "float inputs:intensity = 2\nbool inputs:normalize = 1\nfloat inputs:angle = 0")
            .Le.x,
        2.0f);
    EXPECT_FLOAT_EQ(float(distant_divisor(360)), float(2 * pi_d));
    EXPECT_FLOAT_EQ(float(distant_divisor(180)), float(pi_d));
}

namespace {

/// Gaussian with a width for each side, in nanometers.
double lobe(double x, double peak, double inverse_left, double inverse_right) {
    const double t = (x - peak) * (x < peak ? inverse_left : inverse_right);
    return std::exp(-0.5 * t * t);
}

/// CIE 1931 2° observer. Ref: Wyman, Sloan, Shirley 2013, "Simple Analytic Approximations to the
/// CIE XYZ Color Matching Functions", equation 4.
Vec3d observer(double nm) {
    return {1.056 * lobe(nm, 599.8, 0.0264, 0.0323) + 0.362 * lobe(nm, 442.0, 0.0624, 0.0374) -
                0.065 * lobe(nm, 501.1, 0.0490, 0.0382),
            0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322),
            1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725)};
}

/// Planck's law seen by the observer, in linear Rec.709 of luminance 1: not by a table.
Vec3d blackbody_by_spectrum(double kelvin) {
    Vec3d xyz(0.0);
    for (int nm = 360; nm <= 830; ++nm)
        xyz +=
            observer(nm) * (std::pow(560.0 / nm, 5.0) / std::expm1(1.438776877e7 / (nm * kelvin)));
    const Vec3d rgb(3.2404541621 * xyz.x - 1.5371385128 * xyz.y - 0.4985314096 * xyz.z,
                    -0.9692660305 * xyz.x + 1.8760108454 * xyz.y + 0.0415560175 * xyz.z,
                    0.0556434310 * xyz.x - 0.2040259135 * xyz.y + 1.0572251882 * xyz.z);
    return rgb / (0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z);
}

}  // namespace

TEST(Lights, BlackBodyIsTheOneOfUsdLux) {
    for (double kelvin = 2000; kelvin <= 10000; kelvin += 250) {
        const Vec3d c = color::blackbody_rgb(kelvin), physical = blackbody_by_spectrum(kelvin);
        EXPECT_NEAR(0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z, 1.0, 1e-12);
        // The fits of the observer are good to about 1 %
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(c[i], physical[i], 0.02 * c.x) << kelvin;
    }
    // Returned by UsdLuxBlackbodyTemperatureAsRgb, at knots and between
    const std::pair<double, Vec3d> published[] = {{2000, {2.5205663, 0.6468882, 0.0204040}},
                                                  {4250, {1.3536833, 0.9358438, 0.5940642}},
                                                  {6500, {1.0433334, 0.9836245, 1.0346132}},
                                                  {8750, {0.9138679, 0.9935212, 1.3178025}},
                                                  {10000, {0.8718413, 0.9946880, 1.4299959}}};
    for (const auto& [kelvin, rgb] : published) {
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(color::blackbody_rgb(kelvin)[i], rgb[i], 1e-6) << kelvin;
    }
    EXPECT_EQ(color::blackbody_rgb(1300).z, 0.0);
    EXPECT_EQ(color::blackbody_rgb(20000), color::blackbody_rgb(10000));
    EXPECT_EQ(color::blackbody_rgb(500), color::blackbody_rgb(1000));
    const scene::Light l =
        light("SphereLight",
              "bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = 3000");
    EXPECT_GT(l.Le.x, l.Le.y);
    EXPECT_GT(l.Le.y, l.Le.z);
    EXPECT_NEAR(0.2126f * l.Le.x + 0.7152f * l.Le.y + 0.0722f * l.Le.z, 1.0f, 1e-6f);
}

TEST(Lights, PositionIsRelativeToTheCamera) {
    Translated t;
    translate_text(camera("double3 xformOp:translate = (1, 2, 3)\nuniform token[] xformOpOrder = "
                          "[\"xformOp:translate\"]") +
                       "def SphereLight \"L\" {\ndouble3 xformOp:translate = (11, 2, 2)\n"
                       "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    const Mat4d& m = t.scene.lights[0].render_from_light;
    EXPECT_EQ(Vec3d(m[3][0], m[3][1], m[3][2]), Vec3d(10, 0, -1));
    EXPECT_EQ(t.scene.camera.world_position, Vec3d(1, 2, 3));
}

TEST(Lights, GroupsFollowTheOrderOfPathsAndAreUnique) {
    Translated t;
    translate_text(camera() + R"(
def SphereLight "Key" { string velatura:light:group = "hero"
    string inputs:karma:light:lpetag = "x"; }
def SphereLight "Fill" { string inputs:karma:light:lpetag = "hero"; }
def SphereLight "Rim" { string karma:light:lpetag = "old tag!"; }
def SphereLight "Kick" { string primvars:arnold:aov = "aov1"; }
def Xform "A" {
    def SphereLight "Lamp_1" {}
}
def Xform "B" {
    def SphereLight "Lamp_1" {}
}
def DomeLight "env" {}
def SphereLight "b2" {}
def Xform "C" {
    def SphereLight "b" {}
}
def Xform "D" {
    def SphereLight "b" {}
}
)",
                   t);
    std::vector<std::string> names;
    for (const auto& group : t.scene.groups) names.push_back(group.name);
    EXPECT_EQ(names, (std::vector<std::string>{"Lamp1", "Lamp12", "b", "bL", "hero", "aov1",
                                               "oldtag", "b2L", "envL", "emissive"}));
    ASSERT_EQ(t.scene.groups.size(), 10u);
    EXPECT_EQ(t.scene.groups[4].prims, (std::vector<std::string>{"/Fill", "/Key"}));
    EXPECT_TRUE(t.scene.groups[8].is_environment);
    EXPECT_FALSE(t.scene.groups[0].is_environment);
    EXPECT_EQ(t.scene.emissive_group(), 9u);
    TranslateOptions options;
    options.light_grouping = LightGrouping::Groups;
    Translated grouped;
    translate_text(camera() +
                       "def SphereLight \"A\" { string velatura:light:group = \"g\"; }\ndef "
                       "SphereLight \"B\" {}\n"
                       "def SphereLight \"C\" {}\n",
                   grouped, options);
    ASSERT_EQ(grouped.scene.groups.size(), 3u);
    EXPECT_EQ(grouped.scene.groups[1].name, "rest");
    EXPECT_EQ(grouped.scene.groups[1].prims.size(), 2u);
}

TEST(Lights, GroupsThatAreNoTextAreSaid) {
    for (const char* value : {"float velatura:light:group = 1", "int karma:light:lpetag = 2",
                              "string[] primvars:arnold:aov = [\"key\"]"}) {
        Translated t;
        translate_text(camera() + "def SphereLight \"A\" {\n" + value + "\n}\n", t);
        EXPECT_EQ(t.count("light-group-type"), 1u) << value;
        ASSERT_FALSE(t.scene.groups.empty()) << value;
        EXPECT_EQ(t.scene.groups[0].name, "A") << "the light keeps a group of its own";
    }
    Translated t;
    translate_text(camera() +
                       "def SphereLight \"A\" { token velatura:light:group = \"key\" }\n"
                       "def SphereLight \"B\" { string velatura:light:group = None }\n",
                   t);
    EXPECT_EQ(t.count("light-group-type"), 0u);
}

TEST(Lights, WithoutLightsADomeShines) {
    Translated t;
    translate_text(camera() + quad("Q"), t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    EXPECT_EQ(t.scene.lights[0].kind, scene::LightKind::Dome);
    EXPECT_EQ(t.scene.groups[0].name, "default");
    EXPECT_EQ(t.count("no-lights"), 1u);
    EXPECT_EQ(t.diagnostics.warning_count(), 1u);
}

TEST(Lights, AnyLightPrimKeepsTheDomeAway) {
    for (const char* light :
         {"def SphereLight \"L\" { token visibility = \"invisible\"; }",
          "def SphereLight \"L\" { float inputs:radius = 0; }",
          "def SphereLight \"L\" { token purpose = \"guide\"; }", "def GeometryLight \"L\" {}"}) {
        Translated t;
        translate_text(camera() + quad("Q") + light + "\n", t);
        EXPECT_EQ(t.error, "") << light;
        EXPECT_TRUE(t.scene.lights.empty()) << light;
        EXPECT_EQ(t.count("no-lights"), 0u) << light;
    }
}

TEST(Lights, WhatIsNotHonoredIsNamed) {
    Translated t;
    translate_text(camera() + R"(
def SphereLight "L" (prepend apiSchemas = ["ShapingAPI", "ShadowAPI"]) {
    asset inputs:shaping:ies:file = @a.ies@
    rel light:filters = </F>
}
def LightFilter "F" { uniform token lightFilter:shaderId = "OwnFilter"; }
def GeometryLight "P" {}
def SphereLight "None" { float inputs:radius = 0; }
)",
                   t);
    for (const char* code :
         {"ies-unreadable", "unsupported-light-filter", "unsupported-light", "light-without-size"})
        EXPECT_EQ(t.count(code), 1u) << code;
    EXPECT_EQ(t.scene.lights.size(), 1u);
}

TEST(Lights, PointsAndLinesThatExportersWriteHaveAPower) {
    // Maya and Unreal write radius 0 with treatAsPoint, and no normalize: a normalized light
    for (const auto& [type, hint] :
         {std::pair("SphereLight", "treatAsPoint"), std::pair("CylinderLight", "treatAsLine")}) {
        const std::string start =
            "def " + std::string(type) +
            " \"L\" {\ndouble3 xformOp:translate = (0, 0, -4)\nuniform token[] xformOpOrder = "
            "[\"xformOp:translate\"]\nfloat inputs:radius = 0\n";
        Translated point, normalized;
        translate_text(camera() + start + "bool " + hint + " = 1\n}\n", point);
        translate_text(camera() + start + "bool inputs:normalize = 1\n}\n", normalized);
        ASSERT_EQ(point.scene.lights.size(), 1u) << type;
        ASSERT_EQ(normalized.scene.lights.size(), 1u) << type;
        EXPECT_GT(point.scene.lights[0].radius, 0.0f);
        EXPECT_EQ(point.scene.lights[0].Le, normalized.scene.lights[0].Le);
        EXPECT_EQ(point.scene.lights[0].radius, normalized.scene.lights[0].radius);
        EXPECT_EQ(point.count("light-without-size"), 1u);
    }
    // A hint where there is a size
    EXPECT_EQ(light("SphereLight", "bool treatAsPoint = 1").Le, light("SphereLight", "").Le);
}

TEST(Lights, PortalsOfADomeArePlacedRelativeToTheCamera) {
    Translated t;
    translate_text(camera() + R"(
def DomeLight "Sky" { rel portals = [</Wall/Window>, </Nowhere>]; }
def Xform "Wall" {
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def PortalLight "Window" {
        float inputs:width = 2
        double3 xformOp:scale = (1, 3, 1)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
}
)",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    ASSERT_EQ(t.scene.lights[0].render_from_portals.size(), 1u);
    const Mat4d& m = t.scene.lights[0].render_from_portals[0];
    const Vec3d corner = transform_point(Vec3d(0.5, 0.5, 0), m) + t.scene.camera.world_position;
    EXPECT_EQ(corner, Vec3d(1 + 1.0, 2 + 1.5, 3));
    EXPECT_EQ(t.count("bad-portal"), 1u);
    EXPECT_EQ(t.diagnostics.warning_count(), 1u);
}

TEST(Lights, ShapingIsActiveOnlyWhereItShapes) {
    EXPECT_FALSE(light("SphereLight", "").shaping.is_active);
    EXPECT_TRUE(light("SphereLight", "float inputs:shaping:cone:angle = 40").shaping.is_active);
    EXPECT_TRUE(light("SphereLight", "float inputs:shaping:cone:angle = 90").shaping.is_active);
    EXPECT_FALSE(light("SphereLight", "float inputs:shaping:cone:angle = 180").shaping.is_active);
    // Under shear or with softness a cone of more than 90° cuts from a flat light too
    EXPECT_TRUE(light("RectLight", "float inputs:shaping:cone:angle = 120").shaping.is_active);
    const scene::Light soft = light("RectLight", "float inputs:shaping:cone:softness = 0.5");
    EXPECT_TRUE(soft.shaping.is_active);
    EXPECT_EQ(soft.shaping.cone_angle_deg, 90.0f) << "the schema's fallback";
    EXPECT_TRUE(light("SphereLight", "float inputs:shaping:cone:angle = 120").shaping.is_active);
    EXPECT_TRUE(light("RectLight", "float inputs:shaping:focus = 2").shaping.is_active);
}

TEST(Lights, DomePoleTurnsTheLight) {
    const scene::Light y = light("DomeLight_1", "uniform token poleAxis = \"Y\"");
    EXPECT_EQ(y.render_from_light, Mat4d());
    const scene::Light z = light("DomeLight_1", "uniform token poleAxis = \"Z\"");
    EXPECT_EQ(transform_direction(Vec3d(0, 1, 0), z.render_from_light), Vec3d(0, 0, 1));
    EXPECT_EQ(transform_direction(Vec3d(0, 0, 1), z.render_from_light), Vec3d(0, -1, 0));
    EXPECT_EQ(determinant3(z.render_from_light), 1.0);
}

}  // namespace velatura::translate::lights
