// SPDX-License-Identifier: Apache-2.0
// glTF's material and the unlit surface. Ref: MaterialX 1.39, libraries/bxdf/gltf_pbr.mtlx; Khronos
// Group, glTF 2.0, appendix B, with KHR_materials_clearcoat, _sheen, _specular, _ior, _iridescence,
// _transmission, _volume, _dispersion, _anisotropy and _emissive_strength.
#include "translate/materials/node_surface.h"
#include "translate/materials/pattern_builder.h"

#include <array>
#include <string>

namespace velatura::translate::materials {

using scene::PatternOp;

namespace {

constexpr std::array<std::string_view, 29> known_inputs = {"base_color",
                                                           "metallic",
                                                           "roughness",
                                                           "normal",
                                                           "tangent",
                                                           "occlusion",
                                                           "transmission",
                                                           "specular",
                                                           "specular_color",
                                                           "ior",
                                                           "alpha",
                                                           "alpha_mode",
                                                           "alpha_cutoff",
                                                           "iridescence",
                                                           "iridescence_ior",
                                                           "iridescence_thickness",
                                                           "sheen_color",
                                                           "sheen_roughness",
                                                           "clearcoat",
                                                           "clearcoat_roughness",
                                                           "clearcoat_normal",
                                                           "emissive",
                                                           "emissive_strength",
                                                           "thickness",
                                                           "attenuation_distance",
                                                           "attenuation_color",
                                                           "dispersion",
                                                           "anisotropy_strength",
                                                           "anisotropy_rotation"};

constexpr std::array<std::string_view, 5> unlit_inputs = {
    "emission", "emission_color", "transmission", "transmission_color", "opacity"};

enum class AlphaMode : uint8_t { Opaque, Mask, Blend };

/// An enumeration in MaterialX: a number, or the name that it stands for.
AlphaMode alpha_mode(SurfaceReader& s) {
    const std::string name = s.graph.constant_text(s.shader, "alpha_mode", "");
    if (name == "MASK") return AlphaMode::Mask;
    if (name == "BLEND") return AlphaMode::Blend;
    if (!name.empty()) return AlphaMode::Opaque;
    const double number = s.graph.constant_number(s.shader, "alpha_mode", 0.0);
    return number == 1.0 ? AlphaMode::Mask : number == 2.0 ? AlphaMode::Blend : AlphaMode::Opaque;
}

/// alpha as opacity; false where the mode ignores it.
bool read_alpha(SurfaceReader& s, scene::Material& m) {
    const AlphaMode mode = alpha_mode(s);
    const Port alpha = s.number("alpha", 1.0f);
    if (mode == AlphaMode::Opaque || s.builder().is_constant(alpha, 1.0f)) return false;
    if (mode == AlphaMode::Mask) {
        m.opacity_threshold = float(s.graph.constant_number(s.shader, "alpha_cutoff", 0.5));
        if (!(m.opacity_threshold > 0.0f)) return false;
    }
    m.presence = true;
    m.opacity = s.finish(alpha, Rgb(1.0f));
    return true;
}

/// KHR_materials_transmission is a thin wall, with a thickness of KHR_materials_volume a solid.
void read_transmission(SurfaceReader& s, Port metallic, Port base_color, scene::Material& m) {
    PatternBuilder& b = s.builder();
    const Port share = b.multiply(s.number("transmission", 0.0f), b.invert(metallic));
    s.note_neutral("transmission", share, scene::Effect::Transmission);
    if (!s.can_be_positive(share)) {
        read_alpha(s, m);
        return;
    }
    scene::Material covered;
    if (read_alpha(s, covered))
        s.graph.ctx.warn("unsupported-input", s.shader.attribute("inputs:alpha"),
                         "inputs:alpha is not supported together with inputs:transmission; it is "
                         "ignored");
    m.opacity = s.finish(b.invert(share), Rgb(1.0f));
    m.rough_transmission = true;
    m.thin_walled = !s.can_be_positive(s.number("thickness", 0.0f));
    if (!m.thin_walled)
        m.transmission_depth =
            float(s.graph.constant_number(s.shader, "attenuation_distance", 0.0));
    if (m.transmission_depth > 0.0f && !b.is_constant(base_color, 1.0f))
        s.graph.ctx.warn("unsupported-input", s.shader.attribute("inputs:base_color"),
                         "inputs:base_color does not tint transmission beside "
                         "inputs:attenuation_distance: attenuation_color alone does");
    m.transmission_color =
        s.finish(m.transmission_depth > 0.0f ? s.color("attenuation_color", Rgb(1.0f)) : base_color,
                 Rgb(1.0f));
    // KHR_materials_dispersion: 20 over the Abbe number
    const double dispersion = s.graph.constant_number(s.shader, "dispersion", 0.0);
    if (!m.thin_walled && dispersion > 0.0) m.dispersion = float(dispersion / 20.0);
}

/// The widths αt = α + (1 − α) strength², αb = α in terms of OpenPBR's roughness and anisotropy,
/// which the scene has.
void read_microfacets(SurfaceReader& s, scene::Material& m) {
    PatternBuilder& b = s.builder();
    Port roughness = s.number("roughness", 1.0f);
    const Port strength = s.number("anisotropy_strength", 0.0f);
    if (s.can_be_positive(strength)) {
        const Port one = b.constant(1.0f);
        const Port across =
            b.apply(PatternOp::Maximum, 1, {b.multiply(roughness, roughness), b.constant(1e-4f)});
        const Port along = b.mix(across, one, b.multiply(strength, strength));
        const Port ratio = b.divide(across, along);
        const Port both = b.multiply(b.add(one, b.multiply(ratio, ratio)), b.constant(0.5f));
        const auto root = [&](Port p) { return b.apply(PatternOp::SquareRoot, 1, {p}); };
        roughness = root(b.multiply(along, root(both)));
        m.anisotropy = s.finish(b.invert(ratio));
        m.anisotropy_rotation =
            s.finish(b.multiply(s.number("anisotropy_rotation", 0.0f), b.constant(0.5f / pi)));
        s.graph.entry.needs_tangents = true;
        s.reject_connected("tangent");
    }
    m.roughness = s.finish(roughness, Rgb(1.0f));
}

}  // namespace

scene::Material read_gltf_surface(SurfaceReader& s) {
    PatternBuilder& b = s.builder();
    scene::Material m;
    m.extras.emplace();
    const Port base_color = s.color("base_color", Rgb(1.0f));
    const Port metallic = s.number("metallic", 1.0f);
    m.diffuse_color = s.finish(base_color, Rgb(1.0f));
    m.metallic = s.finish(metallic, Rgb(1.0f));
    s.read_film({"iridescence", 0.0f}, {"iridescence_thickness", 100.0f}, {"iridescence_ior", 1.3f},
                b.constant(1e-3f), m);
    if (s.can_be_positive(metallic))
        s.read_metal(base_color, b.color(Rgb(1.0f)), b.color(Rgb(1.0f)), m);
    m.extras->specular_tint = s.finish(
        b.multiply(s.color("specular_color", Rgb(1.0f)), s.number("specular", 1.0f)), Rgb(1.0f));
    m.ior = s.finish(s.number("ior", 1.5f), Rgb(1.5f));
    read_microfacets(s, m);
    read_transmission(s, metallic, base_color, m);

    const Port coat = s.number("clearcoat", 0.0f);
    m.clearcoat = s.finish(coat);
    s.note_neutral("clearcoat", coat, scene::Effect::Clearcoat);
    m.clearcoat_roughness = s.finish(s.number("clearcoat_roughness", 0.0f));
    if (s.can_be_positive(coat)) s.reject_connected("clearcoat_normal");
    const Port sheen = s.color("sheen_color", Rgb(0.0f));
    s.note_neutral("sheen_color", sheen, scene::Effect::Sheen);
    m.extras->sheen = scene::Input(s.can_be_positive(sheen) ? 1.0f : 0.0f);
    m.extras->sheen_color = s.finish(sheen);
    m.extras->sheen_roughness = s.finish(s.number("sheen_roughness", 0.0f));
    m.emissive_color =
        s.finish(b.multiply(s.color("emissive", Rgb(0.0f)), s.number("emissive_strength", 1.0f)));
    m.normal = s.normal("normal");
    if (s.graph.connected_shader(s.shader, "occlusion"))
        s.graph.ctx.note("ignored-occlusion", s.shader, "occlusion is computed, not read");
    s.warn_unknown(known_inputs);
    return m;
}

scene::Material read_unlit_surface(SurfaceReader& s) {
    scene::Material m;
    m.extras.emplace();
    m.diffuse_color = scene::Input(Rgb(0.0f));
    m.extras->specular_tint = scene::Input(Rgb(0.0f));
    m.ior = scene::Input(Rgb(1.0f));
    m.emissive_color = s.finish(
        s.builder().multiply(s.color("emission_color", Rgb(1.0f)), s.number("emission", 1.0f)));
    const Port opacity = s.number("opacity", 1.0f);
    m.presence = !s.builder().is_constant(opacity, 1.0f);
    if (m.presence) m.opacity = s.finish(opacity, Rgb(1.0f));
    s.reject("transmission", 0.0f);
    s.warn_unknown(unlit_inputs);
    return m;
}

}  // namespace velatura::translate::materials
