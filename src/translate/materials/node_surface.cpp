// SPDX-License-Identifier: Apache-2.0
#include "translate/materials/node_surface.h"

#include "translate/color/color_space.h"
#include "translate/materials/interior.h"
#include "translate/materials/materials.h"
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

namespace velatura::translate::materials {

using scene::PatternOp;
using scene::PatternValue;

namespace {

constexpr std::array<std::string_view, 15> preview_inputs = {
    "diffuseColor",  "emissiveColor",      "useSpecularWorkflow",
    "specularColor", "metallic",           "roughness",
    "clearcoat",     "clearcoatRoughness", "opacity",
    "opacityMode",   "opacityThreshold",   "ior",
    "normal",        "displacement",       "occlusion"};

/// The same numbers as a UsdPreviewSurface of USD, on which MaterialX has modeled its own.
scene::Material read_preview_surface(SurfaceReader& s) {
    scene::Material m;
    m.diffuse_color = s.finish(s.color("diffuseColor", Rgb(0.18f)), Rgb(0.18f));
    m.emissive_color = s.finish(s.color("emissiveColor", Rgb(0.0f)));
    m.use_specular_workflow = s.graph.constant_number(s.shader, "useSpecularWorkflow", 0.0) != 0.0;
    m.specular_color = s.finish(s.color("specularColor", Rgb(0.0f)));
    m.metallic = s.finish(s.number("metallic", 0.0f));
    m.roughness = s.finish(s.number("roughness", 0.5f), Rgb(0.5f));
    m.clearcoat = s.finish(s.number("clearcoat", 0.0f));
    m.clearcoat_roughness = s.finish(s.number("clearcoatRoughness", 0.01f), Rgb(0.01f));
    m.opacity = s.finish(s.number("opacity", 1.0f), Rgb(1.0f));
    m.opacity_threshold = float(s.graph.constant_number(s.shader, "opacityThreshold", 0.0));
    // An enumeration in MaterialX: a number, or the name that it stands for
    const std::string mode = s.graph.constant_text(s.shader, "opacityMode", "");
    m.presence = mode == "presence" ||
                 (mode.empty() && s.graph.constant_number(s.shader, "opacityMode", 0.0) != 0.0);
    m.ior = s.finish(s.number("ior", 1.5f), Rgb(1.5f));
    m.normal = s.normal("normal");
    if (s.graph.connected_shader(s.shader, "occlusion"))
        s.graph.ctx.note("ignored-occlusion", s.shader, "occlusion is computed, not read");
    s.warn_unknown(preview_inputs);
    return m;
}

struct Surface {
    std::string_view id;
    scene::Material (*read)(SurfaceReader& s);
};

constexpr Surface surfaces[] = {
    {"ND_UsdPreviewSurface_surfaceshader", read_preview_surface},
    {"ND_standard_surface_surfaceshader", read_standard_surface},
    {"ND_open_pbr_surface_surfaceshader", read_open_pbr_surface},
    {"ND_gltf_pbr_surfaceshader", read_gltf_surface},
    {"ND_surface_unlit", read_unlit_surface},
};

const Surface* find_surface(std::string_view id) {
    // A version may follow
    const auto* at = std::find_if(std::begin(surfaces), std::end(surfaces),
                                  [&](const Surface& s) { return id.starts_with(s.id); });
    return at == std::end(surfaces) ? nullptr : at;
}

}  // namespace

bool SurfaceReader::can_be_positive(Port p) const {
    const PatternValue* v = graph.builder.constant_value(p);
    if (v == nullptr) return true;
    for (int i = 0; i < p.width; ++i) {
        if ((*v)[i] > 0.0f) return true;
    }
    return false;
}

bool SurfaceReader::is_authored(std::string_view name) const {
    const Attribute input = shader.attribute("inputs:" + std::string(name));
    return input.has_authored_value() || input.has_authored_connections();
}

void SurfaceReader::reject(std::string_view name, float neutral) {
    const Port p = graph.any_input(shader, name, builder().constant(neutral));
    if (builder().is_constant(p, neutral)) return;
    graph.ctx.warn("unsupported-input", shader.attribute("inputs:" + std::string(name)),
                   fmt::format("inputs:{} is not supported; it is ignored", name));
}

void SurfaceReader::note_neutral(std::string_view name, Port p, scene::Effect effect) {
    if (graph.is_authored(shader, name) && !can_be_positive(p))
        graph.ctx.note_zero(effect, shader, fmt::format("{} 0", name));
}

void SurfaceReader::reject_connected(std::string_view name) {
    if (!graph.connected_shader(shader, name)) return;
    graph.ctx.warn("unsupported-input", shader.attribute("inputs:" + std::string(name)),
                   fmt::format("inputs:{} is not supported; it is ignored", name));
}

void SurfaceReader::warn_unknown(std::span<const std::string_view> known) {
    for (const auto& property : shader.property_names()) {
        const std::string_view text = property.view();
        if (!text.starts_with("inputs:")) continue;
        if (std::find(known.begin(), known.end(), text.substr(7)) != known.end()) continue;
        graph.ctx.warn(
            "unknown-shader-input", shader.attribute(text),
            fmt::format("{} has no input {}; it is ignored", graph.id_of(shader), text.substr(7)));
    }
}

scene::Input SurfaceReader::normal(std::string_view name) {
    const Rgb straight(0.0f, 0.0f, 1.0f);
    const Prim source = graph.connected_shader(shader, name);
    const bool is_preview = graph.id_of(shader).find("UsdPreviewSurface") != std::string::npos;
    const std::string category =
        source ? parse_node_name(graph.id_of(source)).category : std::string();
    if (category == "normalmap") {
        const std::string space = graph.constant_text(source, "space", "tangent");
        if (space != "tangent" && !is_preview)
            graph.ctx.warn("unsupported-space", source,
                           fmt::format("normalmap in {} space is not supported, tangent space is "
                                       "used",
                                       space));
        const scene::Input input = finish(graph.normal_map(source), straight);
        graph.entry.needs_tangents |= input.source == scene::Input::Source::Pattern;
        return input;
    }
    // UsdPreviewSurface reads its normal in tangent space, whatever it comes from
    if (is_preview) {
        const scene::Input input = finish(color(name, straight), straight);
        graph.entry.needs_tangents |= input.source == scene::Input::Source::Pattern;
        return input;
    }
    if (source && category != "normal")
        graph.ctx.warn(
            "unsupported-input", shader.attribute("inputs:" + std::string(name)),
            fmt::format("inputs:{} comes from {}, expected a normalmap; the normal of the "
                        "surface is used",
                        name, graph.id_of(source)));
    return scene::Input(straight);
}

void SurfaceReader::read_metal(Port f0, Port f90, Port tint, scene::Material& m) {
    if (m.extras->film) {
        m.extras->film->metal_tint = finish(tint, Rgb(1.0f));
        tint = builder().color(Rgb(1.0f));
    }
    m.extras->metal_f0 = finish(builder().multiply(f0, tint));
    m.extras->metal_f90 = finish(builder().multiply(f90, tint), Rgb(1.0f));
}

void SurfaceReader::read_film(const NamedDefault& weight,
                              const NamedDefault& thickness,
                              const NamedDefault& ior,
                              Port to_micrometers,
                              scene::Material& m) {
    PatternBuilder& b = builder();
    const Port share =
        weight.name.empty() ? b.constant(weight.value) : number(weight.name, weight.value);
    const Port size = b.multiply(number(thickness.name, thickness.value), to_micrometers);
    if (!weight.name.empty()) note_neutral(weight.name, share, scene::Effect::ThinFilm);
    if (!can_be_positive(share)) return;
    note_neutral(thickness.name, size, scene::Effect::ThinFilm);
    if (!can_be_positive(size)) return;
    scene::ThinFilmInputs& film = m.extras->film.emplace();
    film.weight = finish(share, Rgb(1.0f));
    film.thickness = finish(size, Rgb(0.5f));
    film.ior = finish(number(ior.name, ior.value), Rgb(ior.value));
}

void SurfaceReader::read_abbe_number(std::string_view name,
                                     double otherwise,
                                     double scale,
                                     scene::Material& m) {
    const double abbe = graph.constant_number(shader, name, otherwise);
    if (abbe > 0.0) {
        m.dispersion = float(scale / abbe);
    } else if (abbe == 0.0) {
        graph.ctx.note_zero(scene::Effect::Dispersion, shader, fmt::format("{} 0", name));
    } else {
        graph.ctx.warn("material-out-of-range", shader.attribute("inputs:" + std::string(name)),
                       fmt::format("inputs:{} is {:g}, expected an Abbe number above 0; the index "
                                   "of refraction is the same for all wavelengths",
                                   name, abbe));
    }
}

void SurfaceReader::read_scatter(scene::Material& m) {
    const Port scatter = numbers("transmission_scatter", Rgb(0.0f));
    note_neutral("transmission_scatter", scatter, scene::Effect::InteriorMedia);
    if (!can_be_positive(scatter)) return;
    const Attribute attribute = shader.attribute("inputs:transmission_scatter");
    const PatternValue* v = graph.builder.constant_value(scatter);
    if (v == nullptr) {
        graph.ctx.warn("unsupported-connection", attribute,
                       "inputs:transmission_scatter cannot vary inside a solid; it is ignored");
        return;
    }
    m.transmission_scatter = Rgb((*v)[0], (*v)[1], (*v)[2]);
    m.transmission_anisotropy =
        float(graph.constant_number(shader, "transmission_scatter_anisotropy", 0.0));
    check_scatter(graph.ctx, attribute, m);
}

Port schlick_f90(PatternBuilder& b, Port f0, Port at_82) {
    constexpr float weight = 0.46266438f;  // (1 − 1/7)^5
    const Port rest = b.divide(b.subtract(at_82, f0), b.constant(weight));
    return b.clamp(b.add(f0, rest), b.constant(0.0f), b.constant(1.0f));
}

bool is_node_surface(std::string_view id) {
    return find_surface(id) != nullptr;
}

scene::Material read_node_surface(Context& ctx,
                                  Prim shader,
                                  std::string_view id,
                                  MaterialEntry& entry) {
    SurfaceReader s{NodeGraphReader(ctx, entry), shader};
    scene::Material m = find_surface(id)->read(s);
    entry.is_emissive = scene::is_emissive(m);
    return m;
}

scene::Input read_node_displacement(Context& ctx, Prim shader, MaterialEntry& entry) {
    SurfaceReader s{NodeGraphReader(ctx, entry), shader};
    if (s.graph.id_of(shader) != "ND_displacement_float") {
        ctx.warn("unsupported-shader", shader,
                 fmt::format("displacement by {} is not supported, expected ND_displacement_float; "
                             "the surface is not displaced",
                             s.graph.id_of(shader)));
        return scene::Input(0.0f);
    }
    return s.finish(s.builder().multiply(s.number("displacement", 0.0f), s.number("scale", 1.0f)));
}

}  // namespace velatura::translate::materials
