// SPDX-License-Identifier: Apache-2.0
#include "translate/materials/materials.h"

#include "base/nearest_names.h"
#include "translate/context/values.h"
#include "translate/materials/interior.h"
#include "translate/materials/node_surface.h"
#include "translate/materials/shader_inputs.h"
#include "usd/stage/material_binding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::materials {

namespace {

const MaterialEntry no_material;

/// State of this module: bindings of another purpose that a warning named.
struct ReportedBindings {
    std::unordered_set<std::string> paths;
};

/// Inputs of UsdPreviewSurface that this renderer reads or need not read.
constexpr std::array known_inputs = {
    "diffuseColor",     "emissiveColor",      "useSpecularWorkflow",
    "specularColor",    "metallic",           "roughness",
    "clearcoat",        "clearcoatRoughness", "opacity",
    "opacityThreshold", "opacityMode",        "ior",
    "normal",           "displacement",       "occlusion"};

/// What Velatura adds to it (docs/reference/usd_support.md).
constexpr std::array own_inputs = {
    "velatura:roughTransmission",   "velatura:anisotropy",
    "velatura:anisotropyRotation",  "velatura:thinWalled",
    "velatura:diffuseTransmission", "velatura:diffuseTransmissionColor",
    "velatura:transmissionColor",   "velatura:transmissionDepth",
    "velatura:transmissionScatter", "velatura:transmissionScatterAnisotropy",
    "velatura:dielectricPriority",  "velatura:subsurface",
    "velatura:subsurfaceColor",     "velatura:subsurfaceRadius",
    "velatura:subsurfaceAnisotropy"};

/// A hint at the input that was meant, if one is near.
std::string nearest_input(std::string_view input) {
    std::vector<std::string> names(known_inputs.begin(), known_inputs.end());
    names.insert(names.end(), own_inputs.begin(), own_inputs.end());
    const std::string nearest = nearest_spelling(input, names);
    return nearest.empty() ? nearest : fmt::format(" (did you mean '{}'?)", nearest);
}

void warn_shader_features(Context& ctx, Prim shader) {
    const Attribute occlusion = shader.attribute("inputs:occlusion");
    if (occlusion.has_authored_connections())
        ctx.note("ignored-occlusion", shader, "occlusion is computed, not read");
    for (const auto& name : shader.property_names()) {
        const std::string& text = name.str();
        if (text.rfind("inputs:", 0) != 0) continue;
        const std::string_view input = std::string_view(text).substr(7);
        const auto is_in = [&](const auto& names) {
            return std::find(names.begin(), names.end(), input) != names.end();
        };
        if (!is_in(known_inputs) && !is_in(own_inputs)) {
            ctx.warn("unknown-shader-input", shader.attribute(text),
                     fmt::format("UsdPreviewSurface has no input {}{}; it is ignored", input,
                                 nearest_input(input)));
        }
    }
}

bool is_zero(const scene::Input& input) {
    return input.source == scene::Input::Source::Constant && !(input.value.x > 0.0f);
}

/// Which of several solids fills the space that they share.
void read_priority(Context& ctx, InputReader& reader, scene::Material& material) {
    constexpr double max = 1e6;
    const double priority = reader.constant_number("velatura:dielectricPriority", 0.0);
    const bool is_usable = std::abs(priority) <= max && priority == std::floor(priority);
    if (is_usable) {
        material.dielectric_priority = int(priority);
        return;
    }
    ctx.warn(
        "bad-priority", reader.shader.attribute("inputs:velatura:dielectricPriority"),
        fmt::format("inputs:velatura:dielectricPriority is {:g}, expected a whole number within "
                    "±{:g}; 0 is used",
                    priority, max));
}

void read_subsurface(Context& ctx, InputReader& reader, scene::Material& material) {
    const Prim shader = reader.shader;
    material.subsurface = reader.number("velatura:subsurface", 0.0f);
    const Attribute color = shader.attribute("inputs:velatura:subsurfaceColor");
    if (color.has_authored_value() || color.has_authored_connections())
        material.subsurface_color = reader.color("velatura:subsurfaceColor", Rgb(1.0f));
    material.subsurface_radius = reader.vector("velatura:subsurfaceRadius", Rgb(1.0f));
    material.subsurface_anisotropy =
        float(reader.constant_number("velatura:subsurfaceAnisotropy", 0.0));
    if (material.thin_walled && !is_zero(material.subsurface))
        ctx.warn("needs-body", shader.attribute("inputs:velatura:subsurface"),
                 "inputs:velatura:subsurface has no effect on a thin wall, which has no interior");
    if (!(std::abs(material.subsurface_anisotropy) < 1.0f))
        ctx.warn("material-out-of-range", shader.attribute("inputs:velatura:subsurfaceAnisotropy"),
                 "inputs:velatura:subsurfaceAnisotropy is outside (-1, 1) and is clamped");
    const scene::Input& radius = material.subsurface_radius;
    if (scene::is_constant(radius) &&
        !(radius.value.x >= 0.0f && radius.value.y >= 0.0f && radius.value.z >= 0.0f))
        ctx.warn("material-out-of-range", shader.attribute("inputs:velatura:subsurfaceRadius"),
                 "inputs:velatura:subsurfaceRadius is below 0; 0 is used");
}

/// What scatters in the solid.
void read_scatter(Context& ctx, InputReader& reader, scene::Material& material) {
    const Attribute attribute = reader.shader.attribute("inputs:velatura:transmissionScatter");
    const scene::Input scatter = reader.vector("velatura:transmissionScatter", Rgb(0.0f));
    if (!scene::is_constant(scatter))
        ctx.warn(
            "unsupported-connection", attribute,
            "inputs:velatura:transmissionScatter cannot vary inside a solid; its fallback is used");
    material.transmission_scatter = scatter.value;
    material.transmission_anisotropy =
        float(reader.constant_number("velatura:transmissionScatterAnisotropy", 0.0));
    if (!is_black(material.transmission_scatter)) check_scatter(ctx, attribute, material);
}

/// The inputs of Velatura's own.
void read_own_inputs(Context& ctx, InputReader& reader, scene::Material& material) {
    const Prim shader = reader.shader;
    material.rough_transmission = reader.constant_number("velatura:roughTransmission", 0.0) != 0.0;
    material.anisotropy = reader.number("velatura:anisotropy", 0.0f);
    material.anisotropy_rotation = reader.number("velatura:anisotropyRotation", 0.0f);
    reader.entry.needs_tangents = !is_zero(material.anisotropy);
    material.thin_walled = reader.constant_number("velatura:thinWalled", 0.0) != 0.0;
    material.is_solid = !material.thin_walled && has_input(shader, "velatura:thinWalled");
    material.diffuse_transmission = reader.number("velatura:diffuseTransmission", 0.0f);
    if (!is_zero(material.diffuse_transmission) && !material.thin_walled) {
        ctx.warn("needs-thin-walled", shader.attribute("inputs:velatura:diffuseTransmission"),
                 "inputs:velatura:diffuseTransmission needs inputs:velatura:thinWalled = 1; it is "
                 "ignored, because a solid has an interior behind its surface");
    }
    const Attribute behind = shader.attribute("inputs:velatura:diffuseTransmissionColor");
    if (behind.has_authored_value() || behind.has_authored_connections()) {
        material.diffuse_transmission_color =
            reader.color("velatura:diffuseTransmissionColor", Rgb(1.0f));
    }
    material.transmission_color = reader.color("velatura:transmissionColor", Rgb(1.0f));
    material.transmission_depth = float(reader.constant_number("velatura:transmissionDepth", 0.0));
    read_scatter(ctx, reader, material);
    read_priority(ctx, reader, material);
    read_subsurface(ctx, reader, material);
    if (material.thin_walled && material.transmission_depth > 0.0f) {
        ctx.warn("needs-body", shader.attribute("inputs:velatura:transmissionDepth"),
                 "inputs:velatura:transmissionDepth has no effect on a thin wall, which has no "
                 "depth; transmissionColor is its transmittance at normal incidence");
    }
}

/// Inputs whose effect a constant switches off.
struct NeutralInput {
    const char* name;
    double neutral;
    scene::Effect effect;
};

constexpr std::array neutral_inputs = {
    NeutralInput{"opacity", 1, scene::Effect::Transmission},
    NeutralInput{"opacity", 1, scene::Effect::Cutouts},
    NeutralInput{"clearcoat", 0, scene::Effect::Clearcoat},
    NeutralInput{"displacement", 0, scene::Effect::Displacement},
    NeutralInput{"velatura:anisotropy", 0, scene::Effect::Anisotropy},
    NeutralInput{"velatura:roughTransmission", 0, scene::Effect::RoughTransmission},
    NeutralInput{"velatura:thinWalled", 0, scene::Effect::ThinWalls},
    NeutralInput{"velatura:diffuseTransmission", 0, scene::Effect::DiffuseTransmission},
    NeutralInput{"velatura:dielectricPriority", 0, scene::Effect::NestedDielectrics},
    NeutralInput{"velatura:subsurface", 0, scene::Effect::Subsurface},
    NeutralInput{"velatura:transmissionDepth", 0, scene::Effect::Absorption}};

/// Tells the plan which effects the shader authors so that they do nothing.
void note_neutral_inputs(Context& ctx, Prim shader, const scene::Material& material) {
    const auto constant = [&](std::string_view name) {
        const Attribute attribute = shader.attribute("inputs:" + std::string(name));
        return attribute.has_authored_value() && !attribute.has_authored_connections()
                   ? attribute
                   : Attribute();
    };
    for (const NeutralInput& input : neutral_inputs) {
        const Attribute attribute = constant(input.name);
        if (attribute && read_number(attribute, input.neutral, ctx.time) == input.neutral)
            ctx.note_zero(input.effect, shader, fmt::format("{} {:g}", input.name, input.neutral));
    }
    if (constant("velatura:transmissionScatter") && is_black(material.transmission_scatter))
        ctx.note_zero(scene::Effect::InteriorMedia, shader, "velatura:transmissionScatter black");
    if (constant("emissiveColor") && !scene::is_emissive(material))
        ctx.note_zero(scene::Effect::SurfaceEmission, shader, "emissiveColor black");
    if (constant("normal") && material.normal.value == Rgb(0.0f, 0.0f, 1.0f))
        ctx.note_zero(scene::Effect::NormalMaps, shader, "normal (0, 0, 1)");
}

scene::Material read_preview_surface(Context& ctx, Prim shader, MaterialEntry& entry) {
    scene::Material material;
    InputReader reader{ctx, shader, entry};
    material.diffuse_color = reader.color("diffuseColor", Rgb(0.18f));
    material.emissive_color = reader.color("emissiveColor", Rgb(0.0f));
    material.use_specular_workflow = reader.constant_number("useSpecularWorkflow", 0.0) != 0.0;
    material.specular_color = reader.color("specularColor", Rgb(0.0f));
    material.metallic = reader.number("metallic", 0.0f);
    material.roughness = reader.number("roughness", 0.5f);
    material.clearcoat = reader.number("clearcoat", 0.0f);
    material.clearcoat_roughness = reader.number("clearcoatRoughness", 0.01f);
    material.opacity = reader.number("opacity", 1.0f);
    material.opacity_threshold = float(reader.constant_number("opacityThreshold", 0.0));
    material.presence = reader.constant_text("opacityMode", "transparent") == "presence";
    material.ior = reader.number("ior", 1.5f);
    read_own_inputs(ctx, reader, material);
    material.normal = reader.vector("normal", Rgb(0.0f, 0.0f, 1.0f));
    const scene::Input& emission = material.emissive_color;
    entry.is_emissive =
        emission.source != scene::Input::Source::Constant || !is_black(emission.value);
    warn_shader_features(ctx, shader);
    note_neutral_inputs(ctx, shader, material);
    return material;
}

constexpr std::string_view hair_id = "VelaturaHair";

bool is_surface(Context& ctx, Prim shader) {
    const std::string id = read_text(shader.attribute("info:id"), "", ctx.time);
    return id == "UsdPreviewSurface" || id == hair_id || is_node_surface(id);
}

/// Shader that a material's surface output leads to; invalid with a warning when there is none to
/// render.
Prim surface_shader(Context& ctx, Prim material) {
    for (const char* name :
         {"outputs:velatura:surface", "outputs:mtlx:surface", "outputs:surface"}) {
        const Attribute output = material.attribute(name);
        if (!output.has_authored_connections()) continue;
        const ShaderSource source = shader_source(ctx, output);
        const bool is_last = name == std::string_view("outputs:surface");
        // What is written for every renderer stands in for what is not known here
        if (source.shader && !is_last && !is_surface(ctx, source.shader) &&
            material.attribute("outputs:surface").has_authored_connections()) {
            ctx.warn("unsupported-shader", source.shader,
                     fmt::format("surface shader {} is not supported, outputs:surface is used",
                                 read_text(source.shader.attribute("info:id"), "", ctx.time)));
            continue;
        }
        if (source.shader) return source.shader;
        ctx.warn("unconnected-surface", output,
                 "surface output is not connected to a shader; displayColor is rendered");
        return Prim();
    }
    std::string contexts;
    for (const auto& name : material.property_names()) {
        const std::string& text = name.str();
        const bool is_surface = text.size() > 16 && text.rfind("outputs:", 0) == 0 &&
                                text.compare(text.size() - 8, 8, ":surface") == 0;
        if (is_surface) contexts += (contexts.empty() ? "" : ", ") + text;
    }
    ctx.warn("unsupported-material", material,
             contexts.empty() ? "material has no surface output; displayColor is rendered"
                              : fmt::format("only outputs:surface and outputs:mtlx:surface are "
                                            "supported, found {}; displayColor is rendered",
                                            contexts));
    return Prim();
}

/// How far the material moves its surfaces: the input of the UsdPreviewSurface that its
/// displacement output leads to, often the one of the surface. `surface`: that one.
scene::Input read_displacement(Context& ctx, Prim material, Prim surface, MaterialEntry& entry) {
    if (const Attribute nodes = material.attribute("outputs:mtlx:displacement");
        nodes.has_authored_connections()) {
        const Prim shader = shader_source(ctx, nodes).shader;
        return shader ? read_node_displacement(ctx, shader, entry) : scene::Input(0.0f);
    }
    const Attribute output = material.attribute("outputs:displacement");
    const Attribute unused = surface.attribute("inputs:displacement");
    // Interfaces connect inputs that nobody sets
    const ShaderSource unused_source = shader_source(ctx, unused);
    const bool is_authored =
        unused_source.shader || read_number(unused_source.value, 0.0, ctx.time) != 0.0;
    if (!output.has_authored_connections()) {
        if (is_authored)
            ctx.warn("unconnected-displacement", unused,
                     "no outputs:displacement of the material is connected to this shader; the "
                     "surface is not displaced");
        return scene::Input(0.0f);
    }
    const Prim shader = shader_source(ctx, output).shader;
    const std::string id = shader ? read_text(shader.attribute("info:id"), "", ctx.time) : "";
    if (id != "UsdPreviewSurface") {
        ctx.warn("unsupported-material-output", output,
                 fmt::format("outputs:displacement leads to {}, expected a UsdPreviewSurface; the "
                             "surface is not displaced",
                             id.empty() ? "no shader" : id));
        return scene::Input(0.0f);
    }
    InputReader reader{ctx, shader, entry};
    return reader.number("displacement", 0.0f);
}

const MaterialEntry& add_material(Context& ctx,
                                  Prim prim,
                                  scene::Material material,
                                  MaterialEntry& entry) {
    entry.is_displacing = scene::is_displacing(material);
    material.name = entry.name;
    material.provenance = ctx.provenance(prim);
    entry.id = scene::MaterialId(ctx.scene.materials.size());
    ctx.scene.materials.push_back(std::move(material));
    TranslatedMaterials& known = ctx.state<TranslatedMaterials>();
    known.has_emissive = known.has_emissive || entry.is_emissive;
    return entry;
}

const MaterialEntry& material_entry(Context& ctx, Prim material) {
    const auto [it, is_new] =
        ctx.state<TranslatedMaterials>().entries.try_emplace(material.path_string());
    MaterialEntry& entry = it->second;
    if (!is_new) return entry;
    entry.name = material.path_string();
    const std::optional<scene::MediumProperties> medium = read_interior(ctx, material, entry);
    if (medium && !has_surface_output(material))
        return add_material(ctx, material, bare_interior(*medium), entry);
    const Prim shader = surface_shader(ctx, material);
    if (!shader) return entry;
    const std::string id = read_text(shader.attribute("info:id"), "", ctx.time);
    if (!is_surface(ctx, shader)) {
        ctx.warn("unsupported-shader", shader,
                 fmt::format("surface shader {} is not supported, expected UsdPreviewSurface, "
                             "standard_surface, open_pbr_surface, gltf_pbr or surface_unlit; "
                             "displayColor is rendered",
                             id.empty() ? "without info:id" : id));
        return entry;
    }
    scene::Material out = id == hair_id               ? read_hair(ctx, shader, entry)
                          : id == "UsdPreviewSurface" ? read_preview_surface(ctx, shader, entry)
                                                      : read_node_surface(ctx, shader, id, entry);
    out.displacement = read_displacement(ctx, material, shader, entry);
    if (medium) fill_interior(ctx, material, *medium, out);
    return add_material(ctx, material, std::move(out), entry);
}

/// Names a binding that counts under another purpose only.
void warn_other_purpose(Context& ctx, Prim prim) {
    for (const char* purpose : {"full", "preview"}) {
        const auto& asked = ctx.state<TranslatedMaterials>().purposes;
        if (std::find(asked.begin(), asked.end(), purpose) != asked.end()) continue;
        const auto binding = usd::stage::resolve_material(prim, purpose);
        if (!binding.is_bound() ||
            !ctx.state<ReportedBindings>().paths.insert(binding.relation.path_string()).second)
            continue;
        if (ctx.is_quiet) return;
        ctx.diagnostics.warn(
            "other-material-purpose", binding.relation.loc(), prim.path_string(),
            fmt::format("{} is a binding of the purpose {} only, which is not rendered; the bound "
                        "prims use displayColor; --material-purpose {} renders it",
                        binding.relation.path_string(), purpose, purpose));
    }
}

}  // namespace

bool has_binding(Context& ctx, Prim prim) {
    return usd::stage::resolve_material(prim, ctx.state<TranslatedMaterials>().purposes).is_bound();
}

void warn_if_displaced(Context& ctx, Prim prim, const MaterialEntry& material) {
    if (!material.is_displacing) return;
    ctx.warn("unsupported-displacement", prim,
             fmt::format("<{}> displaces meshes only; this {} is not displaced", material.name,
                         prim.type_name().str()));
}

const MaterialEntry& bound_material(Context& ctx, Prim prim) {
    const auto binding =
        usd::stage::resolve_material(prim, ctx.state<TranslatedMaterials>().purposes);
    if (!binding.is_bound()) warn_other_purpose(ctx, prim);
    // The stage has warned about a binding that names no Material; it still wins
    if (!binding.material) return no_material;
    const MaterialEntry& entry = material_entry(ctx, binding.material);
    if (entry.is_hair && prim.type_name() != "BasisCurves") {
        ctx.warn("hair-without-curves", prim,
                 fmt::format("<{}> is a hair material, which needs BasisCurves; this {} is "
                             "rendered as a diffuse surface of its color",
                             entry.name, prim.type_name().str()));
    }
    return entry;
}

}  // namespace velatura::translate::materials
