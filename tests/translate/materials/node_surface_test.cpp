// SPDX-License-Identifier: Apache-2.0
// Surface shaders of MaterialX as materials.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace velatura::translate::materials {
namespace {

using Source = scene::Input::Source;

/// A quad with a surface shader of these inputs.
void translate_surface(const std::string& id, const std::string& inputs, Translated& t) {
    translate_text(quad("Quad", "rel material:binding = </Mat>") + camera() +
                       fmt::format(R"(
def Material "Mat" {{
    token outputs:mtlx:surface.connect = </Mat/S.outputs:out>
    def Shader "S" {{
        uniform token info:id = "{}"
        {}
        token outputs:out
    }}
}}
)",
                                   id, inputs),
                   t);
    ASSERT_EQ(t.error, "") << t.error_message;
    ASSERT_EQ(t.scene.materials.size(), 1u);
}

constexpr const char* standard = "ND_standard_surface_surfaceshader";
constexpr const char* open_pbr = "ND_open_pbr_surface_surfaceshader";

TEST(NodeSurface, StandardSurfaceHasItsDefaults) {
    Translated t;
    translate_surface(standard, "", t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_EQ(m.diffuse_color.value, Rgb(0.8f));
    EXPECT_EQ(m.roughness.value.x, 0.2f);
    EXPECT_EQ(m.ior.value.x, 1.5f);
    EXPECT_EQ(m.extras->specular_tint.value, Rgb(1.0f));
    EXPECT_FALSE(scene::can_transmit(m) || scene::can_cut(m) || scene::is_emissive(m));
    EXPECT_FALSE(scene::can_have_sheen(m) || scene::can_have_rough_base(m));
    EXPECT_EQ(t.count("unsupported-input") + t.count("unknown-shader-input"), 0u);
    EXPECT_TRUE(t.scene.patterns.empty());
}

TEST(NodeSurface, WeightsAndColorsAreMultiplied) {
    Translated t;
    translate_surface(standard,
                      "float inputs:base = 0.5\ncolor3f inputs:base_color = (0.2, 0.4, 0.6)\n"
                      "float inputs:specular = 0.5\ncolor3f inputs:specular_color = (1, 0.5, 0)\n"
                      "float inputs:coat = 0.5\ncolor3f inputs:coat_color = (0.6, 1, 1)\n"
                      "float inputs:coat_affect_color = 2\nfloat inputs:coat_roughness = 0.4\n"
                      "float inputs:coat_affect_roughness = 1\n"
                      "float inputs:emission = 3\ncolor3f inputs:emission_color = (1, 0, 2)\n"
                      "float inputs:sheen = 0.25\ncolor3f inputs:sheen_color = (0, 1, 0)\n"
                      "float inputs:diffuse_roughness = 0.3\nfloat inputs:coat_IOR = 1.7",
                      t);
    const scene::Material& m = t.scene.materials[0];
    // What is below the coat is tinted by mix(1, coat_color, coat), colors to the power of
    // 1 + coat · coat_affect_color = 2
    EXPECT_NEAR(m.diffuse_color.value.x, 0.2f * 0.2f * 0.5f * 0.8f, 1e-6f);
    EXPECT_NEAR(m.diffuse_color.value.z, 0.6f * 0.6f * 0.5f, 1e-6f);
    EXPECT_NEAR(m.extras->specular_tint.value.x, 0.5f * 0.8f, 1e-6f);
    EXPECT_NEAR(m.extras->specular_tint.value.y, 0.25f, 1e-6f);
    EXPECT_NEAR(m.emissive_color.value.x, 3 * 0.8f, 1e-6f);
    EXPECT_NEAR(m.emissive_color.value.z, 6.0f, 1e-6f);
    // mix(0.2, 1, coat · coat_affect_roughness · coat_roughness)
    EXPECT_NEAR(m.roughness.value.x, 0.2f + 0.8f * 0.2f, 1e-6f);
    EXPECT_EQ(m.clearcoat.value.x, 0.5f);
    EXPECT_EQ(m.clearcoat_roughness.value.x, 0.4f);
    EXPECT_EQ(m.extras->coat_ior.value.x, 1.7f);
    EXPECT_EQ(m.extras->sheen.value.x, 0.25f);
    EXPECT_EQ(m.extras->diffuse_roughness.value.x, 0.3f);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
}

TEST(NodeSurface, AnisotropyKeepsItsWidths) {
    Translated t;
    translate_surface(
        standard,
        "float inputs:specular_roughness = 0.4\nfloat inputs:specular_anisotropy = 0.5\n"
        "float inputs:specular_rotation = 0.25",
        t);
    const scene::Material& m = t.scene.materials[0];
    // αx = r² / √(1 − 0.9a), αy = r²·√(1 − 0.9a), from the scene's roughness and anisotropy
    const double aspect = std::sqrt(1 - 0.45), r = double(m.roughness.value.x);
    const double narrow = 1 - double(m.anisotropy.value.x);
    const double alpha_x = r * r * std::sqrt(2 / (1 + narrow * narrow));
    EXPECT_NEAR(alpha_x, 0.16 / aspect, 1e-6);
    EXPECT_NEAR(alpha_x * narrow, 0.16 * aspect, 1e-6);
    EXPECT_EQ(m.anisotropy_rotation.value.x, 0.25f);
}

TEST(NodeSurface, GlassAbsorbsOrTints) {
    Translated t;
    translate_surface(
        standard,
        "float inputs:transmission = 1\ncolor3f inputs:transmission_color = (0.5, 1, 1)\n"
        "float inputs:transmission_depth = 2\nfloat inputs:specular_IOR = 1.33",
        t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_TRUE(scene::can_absorb(m));
    EXPECT_EQ(m.opacity.value.x, 0.0f);
    EXPECT_EQ(m.ior.value.x, 1.33f);
    EXPECT_EQ(m.transmission_depth, 2.0f);
    EXPECT_TRUE(m.rough_transmission);
    Translated metal;
    translate_surface(standard, "float inputs:transmission = 1\nfloat inputs:metalness = 1", metal);
    EXPECT_FALSE(scene::can_transmit(metal.scene.materials[0]));
}

constexpr const char* gltf = "ND_gltf_pbr_surfaceshader";

TEST(NodeSurface, GltfHasItsDefaults) {
    Translated t;
    translate_surface(gltf, "", t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_EQ(m.diffuse_color.value, Rgb(1.0f));
    EXPECT_EQ(m.metallic.value.x, 1.0f);
    EXPECT_EQ(m.extras->metal_f0.value, Rgb(1.0f));
    EXPECT_EQ(m.roughness.value.x, 1.0f);
    EXPECT_EQ(m.ior.value.x, 1.5f);
    EXPECT_FALSE(scene::can_transmit(m) || scene::can_cut(m) || scene::is_emissive(m));
    EXPECT_FALSE(scene::can_have_sheen(m) || m.extras->film.has_value());
    EXPECT_EQ(t.count("unsupported-input") + t.count("unknown-shader-input"), 0u);
}

TEST(NodeSurface, GltfAlphaGoesByItsMode) {
    const std::string alpha = "float inputs:alpha = 0.25\nfloat inputs:alpha_cutoff = 0.3\n";
    Translated opaque, mask, blend;
    translate_surface(gltf, alpha, opaque);
    translate_surface(gltf, alpha + "int inputs:alpha_mode = 1", mask);
    translate_surface(gltf, alpha + "int inputs:alpha_mode = 2", blend);
    EXPECT_EQ(opaque.scene.materials[0].opacity.value.x, 1.0f);
    EXPECT_EQ(mask.scene.materials[0].opacity_threshold, 0.3f);
    EXPECT_EQ(mask.scene.materials[0].opacity.value.x, 0.25f);
    EXPECT_EQ(blend.scene.materials[0].opacity_threshold, 0.0f);
    EXPECT_TRUE(blend.scene.materials[0].presence);
    EXPECT_EQ(blend.scene.materials[0].opacity.value.x, 0.25f);
}

TEST(NodeSurface, GltfTransmitsThroughWallsAndVolumes) {
    const std::string glass =
        "float inputs:metallic = 0\nfloat inputs:transmission = 1\ncolor3f inputs:base_color = "
        "(0.5, 1, 1)\nfloat inputs:attenuation_distance = 2\ncolor3f inputs:attenuation_color = "
        "(1, 0.25, 1)\nfloat inputs:dispersion = 0.4\n";
    Translated wall, solid;
    translate_surface(gltf, glass, wall);
    translate_surface(gltf, glass + "float inputs:thickness = 1", solid);
    const scene::Material &a = wall.scene.materials[0], &b = solid.scene.materials[0];
    EXPECT_TRUE(a.thin_walled && !b.thin_walled);
    EXPECT_EQ(a.opacity.value.x, 0.0f);
    EXPECT_EQ(a.transmission_color.value, Rgb(0.5f, 1, 1));
    EXPECT_EQ(a.dispersion, 0.0f);
    EXPECT_EQ(b.transmission_depth, 2.0f);
    EXPECT_EQ(b.transmission_color.value, Rgb(1, 0.25f, 1));
    EXPECT_FLOAT_EQ(b.dispersion, 0.02f);  // 1 / 50
    // The scene has one color for what a surface and a volume take
    EXPECT_EQ(wall.count("unsupported-input"), 0u);
    EXPECT_EQ(solid.count("unsupported-input"), 1u);
}

TEST(NodeSurface, GltfAnisotropyKeepsItsWidths) {
    Translated t;
    translate_surface(gltf,
                      "float inputs:roughness = 0.4\nfloat inputs:anisotropy_strength = 0.5\n"
                      "float inputs:anisotropy_rotation = 1.5707964",
                      t);
    const scene::Material& m = t.scene.materials[0];
    // KHR_materials_anisotropy: αt = mix(r², 1, strength²), αb = r², from the scene's two numbers
    const double r = double(m.roughness.value.x), narrow = 1 - double(m.anisotropy.value.x);
    const double alpha_x = r * r * std::sqrt(2 / (1 + narrow * narrow));
    EXPECT_NEAR(alpha_x, 0.16 + 0.84 * 0.25, 1e-6);
    EXPECT_NEAR(alpha_x * narrow, 0.16, 1e-6);
    EXPECT_NEAR(m.anisotropy_rotation.value.x, 0.25f, 1e-6f);
}

TEST(NodeSurface, UnlitEmitsAndReflectsNothing) {
    Translated t;
    translate_surface("ND_surface_unlit",
                      "float inputs:emission = 2\ncolor3f inputs:emission_color = (0.1, 0.2, 0.3)\n"
                      "float inputs:opacity = 0.75",
                      t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_EQ(m.emissive_color.value, Rgb(0.2f, 0.4f, 0.6f));
    EXPECT_EQ(m.diffuse_color.value, Rgb(0.0f));
    EXPECT_EQ(m.extras->specular_tint.value, Rgb(0.0f));
    EXPECT_TRUE(m.presence);
    EXPECT_EQ(m.opacity.value.x, 0.75f);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
}

TEST(NodeSurface, OpacityCutsHoles) {
    Translated t;
    translate_surface(standard, "color3f inputs:opacity = (0.5, 0.5, 0.5)", t);
    EXPECT_TRUE(scene::can_cut(t.scene.materials[0]));
    EXPECT_NEAR(t.scene.materials[0].opacity.value.x, 0.5f, 1e-6f);
    Translated both;
    translate_surface(
        standard, "color3f inputs:opacity = (0.5, 0.5, 0.5)\nfloat inputs:transmission = 1", both);
    EXPECT_EQ(both.count("unsupported-input"), 1u);
}

// White edges come nearest to Schlick's own; others meet the model at 82 degrees
TEST(NodeSurface, MetalMeetsItsModelAtTwoAngles) {
    const double weight = std::pow(6 / 7.0, 5);
    Translated t;
    translate_surface(
        open_pbr,
        "float inputs:base_metalness = 1\ncolor3f inputs:base_color = (0.9, 0.5, 0.2)\n"
        "color3f inputs:specular_color = (1, 0.9, 0.8)",
        t);
    const scene::MaterialXInputs& x = *t.scene.materials[0].extras;
    const double base[3] = {0.9, 0.5, 0.2}, edge[3] = {1, 0.9, 0.8};
    for (int c = 0; c < 3; ++c) {
        const double f0 = double(x.metal_f0.value[c]), f90 = double(x.metal_f90.value[c]);
        EXPECT_NEAR(f0, base[c], 1e-6);
        EXPECT_NEAR(f0 + (f90 - f0) * weight, edge[c] * (base[c] + (1 - base[c]) * weight), 1e-5);
    }
    // Gulbrandsen's n and k for reflectance 0.8 and edge tint 0.5, worked out in double
    Translated s;
    translate_surface(standard,
                      "float inputs:metalness = 1\ncolor3f inputs:base_color = (0.8, 0.8, 0.8)\n"
                      "color3f inputs:specular_color = (0.5, 0.5, 0.5)",
                      s);
    const double r = 0.8, g = 0.5, c = 1 / 7.0, root = std::sqrt(r);
    const double n = g * (1 - r) / (1 + r) + (1 - g) * (1 + root) / (1 - root);
    const double k2 = ((n + 1) * (n + 1) * r - (n - 1) * (n - 1)) / (1 - r), sq = n * n + k2;
    const double rs = (sq - 2 * n * c + c * c) / (sq + 2 * n * c + c * c);
    const double rp = (sq * c * c - 2 * n * c + 1) / (sq * c * c + 2 * n * c + 1);
    const scene::MaterialXInputs& y = *s.scene.materials[0].extras;
    EXPECT_NEAR(double(y.metal_f0.value.x), r, 1e-6);
    EXPECT_NEAR(r + (double(y.metal_f90.value.x) - r) * weight, (rs + rp) / 2, 1e-4);
    // metal_edgecolor of standard_surface.mtlx: specular is in it
    Translated half;
    translate_surface(standard,
                      "float inputs:metalness = 1\ncolor3f inputs:base_color = (0.8, 0.8, 0.8)\n"
                      "float inputs:specular = 0.5",
                      half);
    EXPECT_EQ(half.scene.materials[0].extras->metal_f90.value, y.metal_f90.value);
}

TEST(NodeSurface, OpenPbrWeighsTheIndex) {
    Translated t;
    translate_surface(open_pbr,
                      "float inputs:specular_weight = 0.25\nfloat inputs:specular_ior = 1.5\n"
                      "float inputs:fuzz_weight = 0.5\nfloat inputs:emission_luminance = 4",
                      t);
    const scene::Material& m = t.scene.materials[0];
    const double ior = double(m.ior.value.x), r = (ior - 1) / (ior + 1);
    EXPECT_NEAR(r * r, 0.25 * 0.04, 1e-6);
    EXPECT_TRUE(scene::can_have_sheen(m));
    EXPECT_EQ(m.emissive_color.value.x, 4.0f);
    EXPECT_EQ(m.roughness.value.x, 0.3f);
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
}

TEST(NodeSurface, ThinWallsPassWhatLiesDeeper) {
    Translated t;
    translate_surface(open_pbr,
                      "bool inputs:geometry_thin_walled = 1\nfloat inputs:subsurface_weight = 0.6\n"
                      "color3f inputs:subsurface_color = (0.5, 0.5, 0.5)\n"
                      "float inputs:subsurface_scatter_anisotropy = 0.5\ncolor3f inputs:base_color "
                      "= (0.2, 0.2, 0.2)",
                      t);
    const scene::Material& m = t.scene.materials[0];
    ASSERT_TRUE(m.diffuse_transmission_color);
    const double share = double(m.diffuse_transmission.value.x);
    // Half and half, moved by the anisotropy: 0.6 · 0.75 forwards, 0.6 · 0.25 back
    EXPECT_NEAR(share * double(m.diffuse_transmission_color->value.x), 0.45 * 0.5, 1e-6);
    EXPECT_NEAR((1 - share) * double(m.diffuse_color.value.x), 0.4 * 0.2 + 0.15 * 0.5, 1e-6);
}

TEST(NodeSurface, SubsurfaceHasItsRadius) {
    Translated t, o;
    translate_surface(
        standard,
        "float inputs:subsurface = 0.4\ncolor3f inputs:subsurface_color = (0.9, 0.5, 0.2)\n"
        "color3f inputs:subsurface_radius = (1, 0.5, 0.1)\nfloat inputs:subsurface_scale = 0.2\n"
        "float inputs:subsurface_anisotropy = 0.3\ncolor3f inputs:base_color = (0.1, 0.1, 0.1)",
        t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_TRUE(scene::can_scatter_below(m));
    EXPECT_EQ(m.subsurface.value.x, 0.4f);
    EXPECT_EQ(m.subsurface_color->value, Rgb(0.9f, 0.5f, 0.2f));
    EXPECT_NEAR(m.subsurface_radius.value.y, 0.1f, 1e-7f);
    EXPECT_EQ(m.subsurface_anisotropy, 0.3f);
    EXPECT_EQ(m.diffuse_color.value, Rgb(0.1f));
    translate_surface(
        open_pbr, "float inputs:subsurface_weight = 1\nfloat inputs:subsurface_radius = 0.5", o);
    EXPECT_NEAR(o.scene.materials[0].subsurface_radius.value.z, 0.125f, 1e-7f);
    EXPECT_EQ(o.scene.materials[0].subsurface_color->value, Rgb(0.8f));
    EXPECT_EQ(t.count("unsupported-input") + o.count("unsupported-input"), 0u);
}

TEST(NodeSurface, ThinFilms) {
    Translated s, o, none;
    translate_surface(standard,
                      "float inputs:thin_film_thickness = 400\nfloat inputs:thin_film_IOR = 1.3\n"
                      "float inputs:metalness = 1\nfloat inputs:coat = 1\n"
                      "color3f inputs:coat_color = (0.5, 1, 1)\n"
                      "color3f inputs:base_color = (0.8, 0.6, 0.4)",
                      s);
    const scene::Material& m = s.scene.materials[0];
    ASSERT_TRUE(scene::can_have_film(m));
    const scene::ThinFilmInputs& film = *m.extras->film;
    EXPECT_EQ(film.weight.value.x, 1.0f);
    EXPECT_NEAR(film.thickness.value.x, 0.4f, 1e-6f);
    EXPECT_EQ(film.ior.value.x, 1.3f);
    // The coat absorbs, the film does not
    EXPECT_EQ(film.metal_tint.value, Rgb(0.5f, 1.0f, 1.0f));
    EXPECT_EQ(m.extras->metal_f0.value, Rgb(0.8f, 0.6f, 0.4f));

    translate_surface(open_pbr,
                      "float inputs:thin_film_weight = 0.5\nfloat inputs:base_metalness = 1\n"
                      "float inputs:specular_weight = 0.7",
                      o);
    ASSERT_TRUE(scene::can_have_film(o.scene.materials[0]));
    const scene::MaterialXInputs& x = *o.scene.materials[0].extras;
    EXPECT_EQ(x.film->weight.value.x, 0.5f);
    EXPECT_EQ(x.film->thickness.value.x, 0.5f);
    EXPECT_EQ(x.film->ior.value.x, 1.4f);
    EXPECT_EQ(x.film->metal_tint.value, Rgb(0.7f));

    for (const char* nothing : {"", "float inputs:thin_film_weight = 0\n",
                                "float inputs:thin_film_weight = 1\n"
                                "float inputs:thin_film_thickness = 0"}) {
        Translated t;
        translate_surface(open_pbr, nothing, t);
        EXPECT_FALSE(t.scene.materials[0].extras->film.has_value()) << nothing;
    }
    EXPECT_EQ(s.count("unsupported-input") + o.count("unsupported-input"), 0u);
}

TEST(NodeSurface, Dispersion) {
    Translated s, o, none, wrong;
    translate_surface(
        standard, "float inputs:transmission = 1\nfloat inputs:transmission_dispersion = 30", s);
    EXPECT_FLOAT_EQ(s.scene.materials[0].dispersion, 1.0f / 30.0f);
    translate_surface(open_pbr,
                      "float inputs:transmission_weight = 1\n"
                      "float inputs:transmission_dispersion_scale = 0.5",
                      o);
    EXPECT_FLOAT_EQ(o.scene.materials[0].dispersion, 0.5f / 20.0f);
    translate_surface(open_pbr,
                      "float inputs:transmission_weight = 1\n"
                      "float inputs:transmission_dispersion_abbe_number = 30",
                      none);
    EXPECT_EQ(none.scene.materials[0].dispersion, 0.0f);
    translate_surface(standard,
                      "float inputs:transmission = 1\nfloat inputs:transmission_dispersion = -3",
                      wrong);
    EXPECT_EQ(wrong.scene.materials[0].dispersion, 0.0f);
    EXPECT_EQ(wrong.count("material-out-of-range"), 1u);
    EXPECT_EQ(s.count("unsupported-input") + o.count("unsupported-input"), 0u);
}

TEST(NodeSurface, WhatIsNotSimulatedIsNamed) {
    Translated t;
    translate_surface(
        standard,
        "float inputs:coat = 1\n"
        "float inputs:coat_anisotropy = 0.5\nfloat inputs:transmission = 0.5\n"
        "float inputs:transmission_extra_roughness = 0.1\nfloat inputs:unheard_of = 1",
        t);
    EXPECT_EQ(t.count("unsupported-input"), 2u);
    EXPECT_EQ(t.count("unknown-shader-input"), 1u);
    for (const Diagnostic& d : t.diagnostics.all()) {
        if (d.code == "unsupported-input") {
            EXPECT_EQ(d.prim_path, "/Mat/S");
        }
    }
}

TEST(NodeSurface, DisplacementIsScaled) {
    const auto stage = [](const std::string& id) {
        return quad("Quad", "rel material:binding = </Mat>") + camera() + R"(
def Material "Mat" {
    token outputs:mtlx:surface.connect = </Mat/S.outputs:out>
    token outputs:mtlx:displacement.connect = </Mat/D.outputs:out>
    def Shader "S" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        token outputs:out
    }
    def Shader "D" {
        uniform token info:id = ")" +
               id + R"("
        float inputs:displacement = 0.2
        float inputs:scale = 0.5
        token outputs:out
    }
}
)";
    };
    Translated number, vector;
    translate_text(stage("ND_displacement_float"), number);
    translate_text(stage("ND_displacement_vector3"), vector);
    ASSERT_EQ(number.scene.materials.size(), 1u);
    EXPECT_NEAR(number.scene.materials[0].displacement.value.x, 0.1f, 1e-7f);
    ASSERT_EQ(vector.scene.materials.size(), 1u);
    EXPECT_FALSE(scene::is_displacing(vector.scene.materials[0]));
    EXPECT_EQ(vector.count("unsupported-shader"), 1u);
}

TEST(NodeSurface, UnknownSurfacesLeaveTheirDisplayColor) {
    Translated t;
    translate_text(quad("Quad", "rel material:binding = </Mat>") + camera() + R"(
def Material "Mat" {
    token outputs:mtlx:surface.connect = </Mat/S.outputs:out>
    def Shader "S" {
        uniform token info:id = "ND_disney_principled"
        token outputs:out
    }
}
)",
                   t);
    EXPECT_EQ(t.count("unsupported-shader"), 1u);
    EXPECT_TRUE(t.scene.materials.empty());
    EXPECT_EQ(t.scene.shapes[0].material, scene::none);
}

// The context of MaterialX goes before the universal one, which stands in for what is not known
TEST(NodeSurface, TheUniversalOutputStandsIn) {
    const auto stage = [](const std::string& id) {
        return quad("Quad", "rel material:binding = </Mat>") + camera() + R"(
def Material "Mat" {
    token outputs:mtlx:surface.connect = </Mat/S.outputs:out>
    token outputs:surface.connect = </Mat/P.outputs:surface>
    def Shader "S" {
        uniform token info:id = ")" +
               id + R"("
        token outputs:out
    }
    def Shader "P" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }
}
)";
    };
    Translated known, unknown;
    translate_text(stage("ND_standard_surface_surfaceshader"), known);
    translate_text(stage("ND_disney_principled"), unknown);
    ASSERT_EQ(known.scene.materials.size(), 1u);
    EXPECT_TRUE(known.scene.materials[0].extras.has_value());
    ASSERT_EQ(unknown.scene.materials.size(), 1u);
    EXPECT_EQ(unknown.scene.materials[0].diffuse_color.value, Rgb(1, 0, 0));
    EXPECT_EQ(unknown.count("unsupported-shader"), 1u);
}

}  // namespace
}  // namespace velatura::translate::materials
