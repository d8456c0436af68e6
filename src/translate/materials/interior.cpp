// SPDX-License-Identifier: Apache-2.0
// Interior media. Ref: MaterialX 1.38, "Physically Based Shading Nodes", volume distribution
// functions.
#include "translate/materials/interior.h"

#include "translate/materials/materials.h"
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

namespace velatura::translate::materials {

namespace {

constexpr std::array<const char*, 3> volume_outputs = {"outputs:velatura:volume",
                                                       "outputs:mtlx:volume", "outputs:volume"};

/// Coefficients beyond this many per unit are no different from it.
constexpr float max_coefficient = 1e12f;

bool is_node(std::string_view id, std::string_view name) {
    // A version may follow
    return id.starts_with(name) && (id.size() == name.size() || id[name.size()] == '_');
}

/// Numbers that the renderer can do with.
Rgb usable(Context& ctx, const Attribute& from, std::string_view what, const Rgb& read, float max) {
    Rgb value;
    for (int c = 0; c < 3; ++c) value[c] = read[c] > 0.0f ? std::min(read[c], max) : 0.0f;
    if (value != read)
        ctx.warn("material-out-of-range", from,
                 fmt::format("{} must be in 0 to {:g}; it is clamped", what, max));
    return value;
}

float usable_anisotropy(Context& ctx, const Attribute& from, std::string_view what, float read) {
    if (std::abs(read) < 1.0f) return read;
    ctx.warn("material-out-of-range", from,
             fmt::format("{} must be in -1 to 1; it is clamped", what));
    return read > 0.0f ? 1.0f : read < 0.0f ? -1.0f : 0.0f;
}

/// A coefficient, the same everywhere.
Rgb coefficient(NodeGraphReader& graph, Prim shader, std::string_view name) {
    const Port p = graph.numbers(shader, name, graph.builder.color(Rgb(0.0f)));
    const Attribute from = shader.attribute("inputs:" + std::string(name));
    const scene::PatternValue* v = graph.builder.constant_value(p);
    if (v == nullptr) {
        graph.ctx.warn("unsupported-connection", from,
                       fmt::format("{} cannot vary inside a solid; 0 is used", name));
        return Rgb(0.0f);
    }
    return usable(graph.ctx, from, name, Rgb((*v)[0], (*v)[1], (*v)[2]), max_coefficient);
}

/// The distribution that a volume shader leads to, or is.
Prim find_distribution(NodeGraphReader& graph, Prim shader) {
    if (!is_node(graph.id_of(shader), "ND_volume")) return shader;
    if (graph.connected_shader(shader, "edf"))
        graph.ctx.warn("unsupported-input", shader.attribute("inputs:edf"),
                       "inputs:edf is not supported: an interior medium does not emit");
    const Prim distribution = graph.connected_shader(shader, "vdf");
    if (!distribution)
        graph.ctx.warn("unconnected-volume", shader,
                       "inputs:vdf is not connected to a shader; the interior medium is skipped");
    return distribution;
}

}  // namespace

std::optional<scene::MediumProperties> read_interior(Context& ctx,
                                                     Prim material,
                                                     MaterialEntry& entry) {
    const auto is_used = [&](const char* name) {
        return material.attribute(name).has_authored_connections();
    };
    const auto name = std::find_if(volume_outputs.begin(), volume_outputs.end(), is_used);
    if (name == volume_outputs.end()) return std::nullopt;
    const Attribute output = material.attribute(*name);
    NodeGraphReader graph(ctx, entry);
    const Prim shader = shader_source(ctx, output).shader;
    if (!shader) {
        ctx.warn("unconnected-volume", output,
                 "volume output is not connected to a shader; it is ignored");
        return std::nullopt;
    }
    const Prim distribution = find_distribution(graph, shader);
    if (!distribution) return std::nullopt;
    const std::string id = graph.id_of(distribution);
    const bool scatters = is_node(id, "ND_anisotropic_vdf");
    if (!scatters && !is_node(id, "ND_absorption_vdf")) {
        ctx.warn("unsupported-material-output", distribution,
                 fmt::format("volume shader {} is not supported for an interior medium, expected "
                             "ND_absorption_vdf or ND_anisotropic_vdf; it is ignored",
                             id.empty() ? "without info:id" : id));
        return std::nullopt;
    }
    scene::MediumProperties medium;
    medium.absorption = coefficient(graph, distribution, "absorption");
    if (!scatters) return medium;
    medium.scattering = coefficient(graph, distribution, "scattering");
    medium.anisotropy =
        usable_anisotropy(ctx, distribution.attribute("inputs:anisotropy"), "anisotropy",
                          float(graph.constant_number(distribution, "anisotropy", 0.0)));
    if (graph.is_authored(distribution, "scattering") && is_black(medium.scattering))
        ctx.note_zero(scene::Effect::InteriorMedia, distribution, "scattering 0");
    return medium;
}

bool has_surface_output(Prim material) {
    for (const auto& name : material.property_names()) {
        const std::string_view text = name.view();
        const bool is_surface = text.starts_with("outputs:") &&
                                (text == "outputs:surface" || text.ends_with(":surface"));
        if (is_surface && material.attribute(text).has_authored_connections()) return true;
    }
    return false;
}

bool has_volume_output(Prim material) {
    return std::any_of(volume_outputs.begin(), volume_outputs.end(), [&](const char* name) {
        return material.attribute(name).has_authored_connections();
    });
}

scene::Material bare_interior(const scene::MediumProperties& medium) {
    scene::Material material;
    material.is_bare = true;
    material.has_specular = false;
    material.diffuse_color = scene::Input(Rgb(0.0f));
    material.opacity = scene::Input(0.0f);
    material.ior = scene::Input(1.0f);
    material.interior = medium;
    return material;
}

void fill_interior(Context& ctx,
                   Prim prim,
                   const scene::MediumProperties& medium,
                   scene::Material& material) {
    material.interior = medium;
    if (material.thin_walled)
        ctx.warn("needs-body", prim,
                 "the volume output has no effect: the surface of the material is a thin wall, "
                 "which has no interior");
}

void check_scatter(Context& ctx, const Attribute& from, scene::Material& material) {
    const std::string name = from.is_valid() ? from.name().str() : std::string();
    material.transmission_scatter =
        usable(ctx, from, name, material.transmission_scatter, max_coefficient);
    material.transmission_anisotropy =
        usable_anisotropy(ctx, from, name + "'s anisotropy", material.transmission_anisotropy);
    const bool has_inside = material.transmission_depth > 0.0f && !material.thin_walled;
    if (!has_inside && !is_black(material.transmission_scatter))
        ctx.warn("needs-depth", from,
                 fmt::format("{} needs a transmission depth above 0 and a surface that is not a "
                             "thin wall; it is ignored",
                             name));
}

}  // namespace velatura::translate::materials
