// SPDX-License-Identifier: Apache-2.0
// What bodies are filled with: volume shaders and the scattering of transmission.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace velatura::translate::materials {
namespace {

/// A quad whose material has these outputs and shaders.
void translate_material(const std::string& text, Translated& t) {
    translate_text(quad("Quad", "rel material:binding = </Mat>") + camera() +
                       fmt::format("def Material \"Mat\" {{\n{}\n}}\n", text),
                   t);
    ASSERT_EQ(t.error, "") << t.error_message;
}

std::string shader(const std::string& name, const std::string& id, const std::string& inputs) {
    return fmt::format(
        "def Shader \"{}\" {{ uniform token info:id = \"{}\"\n{}\ntoken outputs:out\n}}\n", name,
        id, inputs);
}

std::string output(const std::string& name, const std::string& of) {
    return fmt::format("token outputs:{}.connect = </Mat/{}.outputs:out>\n", name, of);
}

void expect_rgb(const Rgb& read, double r, double g, double b) {
    EXPECT_NEAR(read.x, r, 1e-6);
    EXPECT_NEAR(read.y, g, 1e-6);
    EXPECT_NEAR(read.z, b, 1e-6);
}

const std::string fog =
    shader("V",
           "ND_anisotropic_vdf",
           "float3 inputs:absorption = (0.1, 0.2, 0.3)\n"
           "float3 inputs:scattering = (1, 2, 3)\nfloat inputs:anisotropy = 0.4");

TEST(BodyMatter, WithoutASurfaceIsABareBody) {
    for (const char* name : {"volume", "mtlx:volume", "velatura:volume"}) {
        Translated t;
        translate_material(output(name, "V") + fog, t);
        ASSERT_EQ(t.scene.materials.size(), 1u) << name;
        const scene::Material& m = t.scene.materials[0];
        EXPECT_TRUE(m.is_bare);
        EXPECT_TRUE(scene::scatters_inside(m) && scene::can_absorb(m));
        const scene::MediumProperties inside = scene::medium_properties_inside(m);
        expect_rgb(inside.absorption, 0.1, 0.2, 0.3);
        expect_rgb(inside.scattering, 1, 2, 3);
        EXPECT_EQ(inside.anisotropy, 0.4f);
        EXPECT_EQ(t.count("unsupported-material"), 0u);
    }
}

TEST(BodyMatter, FillsWhatItsSurfaceBounds) {
    Translated t;
    translate_material(
        output("surface", "S") + output("volume", "N") + fog +
            shader("N", "ND_volume", "token inputs:vdf.connect = </Mat/V.outputs:out>") +
            shader("S", "UsdPreviewSurface", "float inputs:opacity = 0"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u);
    EXPECT_FALSE(t.scene.materials[0].is_bare);
    EXPECT_EQ(t.scene.materials[0].ior.value.x, 1.5f);
    expect_rgb(scene::medium_properties_inside(t.scene.materials[0]).scattering, 1, 2, 3);
    // What lets no light in has no inside to be seen
    Translated opaque;
    translate_material(
        output("surface", "S") + output("volume", "V") + fog + shader("S", "UsdPreviewSurface", ""),
        opaque);
    EXPECT_FALSE(scene::scatters_inside(opaque.scene.materials[0]));
}

TEST(BodyMatter, AbsorptionAloneScattersNothing) {
    Translated t;
    translate_material(output("volume", "V") +
                           shader("V", "ND_absorption_vdf", "float3 inputs:absorption = (1, 2, 4)"),
                       t);
    const scene::Material& m = t.scene.materials[0];
    EXPECT_TRUE(scene::can_absorb(m));
    EXPECT_FALSE(scene::scatters_inside(m));
    expect_rgb(scene::medium_properties_inside(m).absorption, 1, 2, 4);
}

TEST(BodyMatter, WhatCannotFillABodyIsNamed) {
    const auto count = [](const std::string& text, const char* code) {
        Translated t;
        translate_material(text, t);
        return t.count(code);
    };
    EXPECT_EQ(
        count(output("volume", "V") + shader("V", "Smoke", ""), "unsupported-material-output"), 1u);
    EXPECT_EQ(count(output("volume", "None"), "unconnected-volume"), 1u);
    EXPECT_EQ(count(output("volume", "V") + shader("V", "ND_volume", ""), "unconnected-volume"),
              1u);
    const std::string glowing = output("volume", "N") + fog + shader("E", "ND_uniform_edf", "") +
                                shader("N", "ND_volume",
                                       "token inputs:vdf.connect = </Mat/V.outputs:out>\n"
                                       "token inputs:edf.connect = </Mat/E.outputs:out>");
    EXPECT_EQ(count(glowing, "unsupported-input"), 1u);
    const std::string wrong =
        output("volume", "V") +
        shader("V", "ND_anisotropic_vdf",
               "float3 inputs:absorption = (-1, 0, 0)\n"
               "float3 inputs:scattering = (1, 1, 1)\nfloat inputs:anisotropy = 3");
    EXPECT_EQ(count(wrong, "material-out-of-range"), 2u);
    const std::string varying = output("volume", "V") +
                                shader("V", "ND_absorption_vdf",
                                       "float3 inputs:absorption.connect = </Mat/N.outputs:out>") +
                                shader("N", "ND_position_vector3", "");
    EXPECT_EQ(count(varying, "unsupported-connection"), 1u);
    const std::string thin =
        output("surface", "S") + output("volume", "V") + fog +
        shader("S", "UsdPreviewSurface",
               "float inputs:opacity = 0\nbool inputs:velatura:thinWalled = 1");
    EXPECT_EQ(count(thin, "needs-body"), 1u);
}

/// What is inside of a surface shader of these inputs.
scene::MediumProperties inside_of(const std::string& id, const std::string& inputs, Translated& t) {
    translate_material(output("mtlx:surface", "S") + shader("S", id, inputs), t);
    return t.scene.materials.empty() ? scene::MediumProperties()
                                     : scene::medium_properties_inside(t.scene.materials[0]);
}

TEST(BodyMatter, OfTransmissionIsThatOfOpenPbr) {
    // σt = −ln color / depth, σs = scatter / depth, and what is left absorbs
    for (const char* id :
         {"ND_standard_surface_surfaceshader", "ND_open_pbr_surface_surfaceshader"}) {
        const std::string weight = std::string(id).find("open") == std::string::npos
                                       ? "float inputs:transmission = 1\n"
                                       : "float inputs:transmission_weight = 1\n";
        Translated t;
        const scene::MediumProperties inside =
            inside_of(id,
                      weight +
                          "color3f inputs:transmission_color = (0.1, 0.4, 0.5)\n"
                          "float inputs:transmission_depth = 2\n"
                          "color3f inputs:transmission_scatter = (0.3, 0.2, 0)\n"
                          "float inputs:transmission_scatter_anisotropy = 0.25",
                      t);
        expect_rgb(inside.scattering, 0.15, 0.1, 0);
        expect_rgb(inside.absorption, -std::log(0.1) / 2 - 0.15, -std::log(0.4) / 2 - 0.1,
                   -std::log(0.5) / 2);
        EXPECT_EQ(inside.anisotropy, 0.25f);
        EXPECT_EQ(t.count("unsupported-input"), 0u);

        // More is scattered than the color loses: absorption is shifted until none is below 0
        Translated shifted;
        const scene::MediumProperties white =
            inside_of(id,
                      weight +
                          "float inputs:transmission_depth = 2\n"
                          "color3f inputs:transmission_scatter = (1, 0.5, 0)",
                      shifted);
        expect_rgb(white.scattering, 0.5, 0.25, 0);
        expect_rgb(white.absorption, 0, 0.25, 0.5);
    }
}

TEST(BodyMatter, OfTransmissionNeedsADepth) {
    Translated t;
    const scene::MediumProperties inside =
        inside_of("ND_open_pbr_surface_surfaceshader",
                  "float inputs:transmission_weight = 1\n"
                  "color3f inputs:transmission_scatter = (1, 1, 1)",
                  t);
    EXPECT_TRUE(is_black(inside.scattering));
    EXPECT_EQ(t.count("needs-depth"), 1u);
}

TEST(BodyMatter, OfVelaturasOwnInputs) {
    Translated t;
    const scene::MediumProperties inside =
        inside_of("UsdPreviewSurface",
                  "float inputs:opacity = 0\n"
                  "float inputs:velatura:transmissionDepth = 0.5\n"
                  "color3f inputs:velatura:transmissionColor = (0.25, 0.25, 0.25)\n"
                  "color3f inputs:velatura:transmissionScatter = (0.1, 0.2, -1)\n"
                  "float inputs:velatura:transmissionScatterAnisotropy = -0.5",
                  t);
    expect_rgb(inside.scattering, 0.2, 0.4, 0);
    expect_rgb(inside.absorption, 2 * std::log(4.0) - 0.2, 2 * std::log(4.0) - 0.4,
               2 * std::log(4.0));
    EXPECT_EQ(inside.anisotropy, -0.5f);
    EXPECT_EQ(t.count("material-out-of-range"), 1u);
}

}  // namespace
}  // namespace velatura::translate::materials
