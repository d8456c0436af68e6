// SPDX-License-Identifier: Apache-2.0
// Shaders of fibers: info:id VelaturaHair (docs/reference/usd_support.md).
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace velatura::translate::materials {

namespace {

constexpr std::array hair_inputs = {"color",      "eumelanin",   "pheomelanin",
                                    "absorption", "roughness",   "azimuthalRoughness",
                                    "ior",        "cuticleAngle"};

constexpr float unbounded = std::numeric_limits<float>::infinity();

/// Warns of a constant that the model has no meaning for; it is clamped where it is used.
void check_range(
    Context& ctx, Prim shader, const char* name, const Rgb& value, float low, float high) {
    bool is_within = true;
    for (int c = 0; c < 3; ++c) is_within = is_within && value[c] >= low && value[c] <= high;
    if (is_within) return;
    const std::string range = high < unbounded ? fmt::format("outside [{:g}, {:g}]", low, high)
                                               : fmt::format("not a number of {:g} or more", low);
    ctx.warn("material-out-of-range", shader.attribute(std::string("inputs:") + name),
             fmt::format("inputs:{} is {} and is clamped", name, range));
}

void check_range(
    Context& ctx, Prim shader, const char* name, const scene::Input& input, float low, float high) {
    if (scene::is_constant(input)) check_range(ctx, shader, name, input.value, low, high);
}

void warn_unknown_inputs(Context& ctx, Prim shader) {
    for (const auto& name : shader.property_names()) {
        const std::string& text = name.str();
        if (text.rfind("inputs:", 0) != 0) continue;
        const std::string input = text.substr(7);
        if (std::find(hair_inputs.begin(), hair_inputs.end(), input) == hair_inputs.end())
            ctx.warn("unknown-shader-input", shader.attribute(text),
                     fmt::format("VelaturaHair has no input {}; it is ignored", input));
    }
}

/// The strongest of the ways to say what absorbs.
scene::Hair::Absorber read_absorber(Context& ctx, Prim shader) {
    using Absorber = scene::Hair::Absorber;
    const bool has_color = has_input(shader, "color");
    const bool has_melanin = has_input(shader, "eumelanin") || has_input(shader, "pheomelanin");
    const bool has_coefficient = has_input(shader, "absorption");
    if (int(has_color) + int(has_melanin) + int(has_coefficient) > 1)
        ctx.warn("several-hair-colors", shader,
                 fmt::format("color, melanin and absorption are alternatives; {} is used",
                             has_coefficient ? "absorption" : "melanin"));
    if (has_coefficient) return Absorber::Coefficient;
    return has_color && !has_melanin ? Absorber::Color : Absorber::Melanin;
}

/// The absorption that lets pass, over the radius of a fiber, the color in the working space that
/// this one lets pass in linear Rec.709. Longer ways are close to it: absorption is no color.
Rgb working_absorption(Context& ctx, const Rgb& absorption) {
    if (ctx.state<color::WorkingSpace>().is_rec709()) return absorption;
    Vec3d passed;
    for (int c = 0; c < 3; ++c) passed[c] = std::exp(-double(absorption[c]));
    passed = color::from_rec709(ctx, passed);
    Rgb out;
    for (int c = 0; c < 3; ++c) out[c] = float(-std::log(std::clamp(passed[c], 1e-6, 1.0)));
    return out;
}

}  // namespace

scene::Material read_hair(Context& ctx, Prim shader, MaterialEntry& entry) {
    InputReader reader{ctx, shader, entry};
    scene::Hair hair;
    hair.absorber = read_absorber(ctx, shader);
    hair.color = reader.color("color", hair.color.value);
    // One of the two alone is all there is
    const bool has_red = has_input(shader, "pheomelanin");
    hair.eumelanin = reader.number("eumelanin", has_red ? 0.0f : hair.eumelanin.value.x);
    hair.pheomelanin = reader.number("pheomelanin", hair.pheomelanin.value.x);
    hair.eumelanin_absorption = working_absorption(ctx, hair.eumelanin_absorption);
    hair.pheomelanin_absorption = working_absorption(ctx, hair.pheomelanin_absorption);
    hair.absorption = reader.vector("absorption", hair.absorption.value);
    hair.roughness = reader.number("roughness", hair.roughness.value.x);
    hair.azimuthal_roughness =
        reader.number("azimuthalRoughness", hair.azimuthal_roughness.value.x);
    hair.ior = float(reader.constant_number("ior", double(hair.ior)));
    hair.cuticle_angle_deg =
        float(reader.constant_number("cuticleAngle", double(hair.cuticle_angle_deg)));
    check_range(ctx, shader, "color", hair.color, 0.0f, 1.0f);
    check_range(ctx, shader, "eumelanin", hair.eumelanin, 0.0f, unbounded);
    check_range(ctx, shader, "pheomelanin", hair.pheomelanin, 0.0f, unbounded);
    check_range(ctx, shader, "absorption", hair.absorption, 0.0f, unbounded);
    check_range(ctx, shader, "roughness", hair.roughness, 0.0f, 1.0f);
    check_range(ctx, shader, "azimuthalRoughness", hair.azimuthal_roughness, 0.0f, 1.0f);
    check_range(ctx, shader, "ior", Rgb(hair.ior), 1.001f, 3.0f);
    check_range(ctx, shader, "cuticleAngle", Rgb(hair.cuticle_angle_deg), -18.0f, 18.0f);
    warn_unknown_inputs(ctx, shader);

    // What is no curve is matt
    scene::Material material;
    material.has_specular = false;
    if (hair.absorber == scene::Hair::Absorber::Color) material.diffuse_color = hair.color;
    material.hair = std::move(hair);
    entry.is_hair = true;
    return material;
}

}  // namespace velatura::translate::materials
