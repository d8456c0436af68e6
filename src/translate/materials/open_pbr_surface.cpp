// SPDX-License-Identifier: Apache-2.0
// OpenPBR. Ref: Academy Software Foundation, "OpenPBR Surface" specification 1.1.
#include "translate/materials/node_surface.h"
#include "translate/materials/pattern_builder.h"

#include <array>

namespace velatura::translate::materials {

using scene::PatternOp;

namespace {

constexpr std::array<std::string_view, 41> known_inputs = {"base_weight",
                                                           "base_color",
                                                           "base_diffuse_roughness",
                                                           "base_metalness",
                                                           "specular_weight",
                                                           "specular_color",
                                                           "specular_roughness",
                                                           "specular_ior",
                                                           "specular_roughness_anisotropy",
                                                           "transmission_weight",
                                                           "transmission_color",
                                                           "transmission_depth",
                                                           "transmission_scatter",
                                                           "transmission_scatter_anisotropy",
                                                           "transmission_dispersion_scale",
                                                           "transmission_dispersion_abbe_number",
                                                           "subsurface_weight",
                                                           "subsurface_color",
                                                           "subsurface_radius",
                                                           "subsurface_radius_scale",
                                                           "subsurface_scatter_anisotropy",
                                                           "fuzz_weight",
                                                           "fuzz_color",
                                                           "fuzz_roughness",
                                                           "coat_weight",
                                                           "coat_color",
                                                           "coat_roughness",
                                                           "coat_roughness_anisotropy",
                                                           "coat_ior",
                                                           "coat_darkening",
                                                           "thin_film_weight",
                                                           "thin_film_thickness",
                                                           "thin_film_ior",
                                                           "emission_luminance",
                                                           "emission_color",
                                                           "geometry_opacity",
                                                           "geometry_thin_walled",
                                                           "geometry_normal",
                                                           "geometry_coat_normal",
                                                           "geometry_tangent",
                                                           "geometry_coat_tangent"};

/// The index of refraction whose reflectance at normal incidence is `weight` times that of `ior`,
/// on the same side of 1 (specification 1.1, "Dielectric base").
Port modulated_ior(PatternBuilder& b, Port ior, Port weight) {
    if (b.is_constant(weight, 1.0f)) return ior;
    const Port one = b.constant(1.0f);
    const Port root = b.divide(b.subtract(ior, one), b.add(ior, one));
    const Port w = b.apply(PatternOp::Maximum, 1, {weight, b.constant(0.0f)});
    const Port scaled = b.clamp(b.multiply(root, b.apply(PatternOp::SquareRoot, 1, {w})),
                                b.constant(-0.999f), b.constant(0.999f));
    return b.divide(b.add(one, scaled), b.subtract(one, scaled));
}

/// Coat: its own lobe, and the tint of all that is below. Returns: the tint.
Port read_coat(SurfaceReader& s, scene::Material& m) {
    PatternBuilder& b = s.builder();
    const Port weight = s.number("coat_weight", 0.0f);
    m.clearcoat = s.finish(weight);
    s.note_neutral("coat_weight", weight, scene::Effect::Clearcoat);
    m.clearcoat_roughness = s.finish(s.number("coat_roughness", 0.0f));
    m.extras->coat_ior = s.finish(s.number("coat_ior", 1.6f), Rgb(1.6f));
    if (s.can_be_positive(weight)) {
        s.reject("coat_roughness_anisotropy", 0.0f);
        s.reject_connected("geometry_coat_normal");
        if (s.can_be_positive(s.number("coat_darkening", 1.0f)))
            s.graph.ctx.warn("unsupported-input", s.shader,
                             "inputs:coat_darkening (default 1) is not supported; light reflected "
                             "inside the coat keeps its color");
    }
    const Port share = b.clamp(weight, b.constant(0.0f), b.constant(1.0f));
    return b.mix(b.color(Rgb(1.0f)), s.color("coat_color", Rgb(1.0f)), share);
}

void read_transmission(SurfaceReader& s, Port metalness, Port tint, scene::Material& m) {
    PatternBuilder& b = s.builder();
    const Port share = b.multiply(s.number("transmission_weight", 0.0f), b.invert(metalness));
    const Port opacity = s.number("geometry_opacity", 1.0f);
    const bool is_whole = b.is_constant(opacity, 1.0f);
    s.note_neutral("transmission_weight", share, scene::Effect::Transmission);
    if (!s.can_be_positive(share)) {
        if (is_whole) return;
        m.presence = true;
        m.opacity = s.finish(opacity, Rgb(1.0f));
        return;
    }
    if (!is_whole)
        s.graph.ctx.warn("unsupported-input", s.shader.attribute("inputs:geometry_opacity"),
                         "inputs:geometry_opacity is not supported together with "
                         "inputs:transmission_weight; it is ignored");
    m.opacity = s.finish(b.invert(share), Rgb(1.0f));
    m.rough_transmission = true;
    if (!m.thin_walled)
        m.transmission_depth = float(s.graph.constant_number(s.shader, "transmission_depth", 0.0));
    Port color = s.color("transmission_color", Rgb(1.0f));
    if (!(m.transmission_depth > 0.0f)) color = b.multiply(color, tint);
    m.transmission_color = s.finish(color, Rgb(1.0f));
    s.read_scatter(m);
    if (m.thin_walled) return;
    const double scale = s.graph.constant_number(s.shader, "transmission_dispersion_scale", 0.0);
    if (scale > 0.0)
        s.read_abbe_number("transmission_dispersion_abbe_number", 20.0, scale, m);
    else if (s.is_authored("transmission_dispersion_scale"))
        s.graph.ctx.note_zero(scene::Effect::Dispersion, s.shader,
                              "transmission_dispersion_scale 0");
}

/// Diffuse base and what lies deeper than it; of a thin wall, half of that goes through.
void read_diffuse(SurfaceReader& s, Port base_color, Port tint, scene::Material& m) {
    PatternBuilder& b = s.builder();
    Port diffuse = base_color;
    const Port weight = s.number("subsurface_weight", 0.0f);
    s.note_neutral("subsurface_weight", weight, scene::Effect::Subsurface);
    if (s.can_be_positive(weight)) {
        const Port color = s.color("subsurface_color", Rgb(0.8f));
        if (m.thin_walled) {
            const Port forward =
                b.multiply(b.add(b.constant(1.0f), s.number("subsurface_scatter_anisotropy", 0.0f)),
                           b.constant(0.5f));
            const Port share = b.multiply(weight, forward);
            const Port back = b.multiply(b.multiply(color, weight), b.invert(forward));
            // The scene takes the share that passes off what is reflected
            diffuse =
                b.divide(b.add(b.multiply(base_color, b.invert(weight)), back), b.invert(share));
            m.diffuse_transmission = s.finish(share);
            m.diffuse_transmission_color = s.finish(b.multiply(color, tint));
        } else {
            m.subsurface = s.finish(weight);
            m.subsurface_color = s.finish(b.multiply(color, tint), Rgb(0.8f));
            m.subsurface_radius =
                s.finish(b.multiply(s.numbers("subsurface_radius_scale", Rgb(1.0f, 0.5f, 0.25f)),
                                    s.number("subsurface_radius", 1.0f)),
                         Rgb(1.0f));
            m.subsurface_anisotropy =
                float(s.graph.constant_number(s.shader, "subsurface_scatter_anisotropy", 0.0));
        }
    }
    m.diffuse_color = s.finish(b.multiply(diffuse, tint), Rgb(0.8f));
    const Port roughness = s.number("base_diffuse_roughness", 0.0f);
    m.extras->diffuse_roughness = s.finish(roughness);
    s.note_neutral("base_diffuse_roughness", roughness, scene::Effect::RoughDiffuse);
}

}  // namespace

scene::Material read_open_pbr_surface(SurfaceReader& s) {
    PatternBuilder& b = s.builder();
    scene::Material m;
    m.extras.emplace();
    m.thin_walled = s.graph.constant_number(s.shader, "geometry_thin_walled", 0.0) != 0.0;
    m.is_solid = !m.thin_walled && s.is_authored("geometry_thin_walled");
    const Port tint = read_coat(s, m);
    const Port metalness = s.number("base_metalness", 0.0f);
    const Port base_color =
        b.multiply(s.color("base_color", Rgb(0.8f)), s.number("base_weight", 1.0f));
    read_diffuse(s, base_color, tint, m);

    // Metal and dielectric
    const Port weight = s.number("specular_weight", 1.0f);
    const Port color = s.color("specular_color", Rgb(1.0f));
    m.metallic = s.finish(metalness);
    s.read_film({"thin_film_weight", 0.0f}, {"thin_film_thickness", 0.5f}, {"thin_film_ior", 1.4f},
                b.constant(1.0f), m);
    if (s.can_be_positive(metalness)) {
        // F82-tint: specular_color times Schlick's reflectance at a cosine of 1/7
        const Port schlick = b.mix(base_color, b.color(Rgb(1.0f)), b.constant(0.46266438f));
        const Port f90 = b.is_constant(color, 1.0f)
                             ? b.color(Rgb(1.0f))
                             : schlick_f90(b, base_color, b.multiply(schlick, color));
        s.read_metal(base_color, f90, b.multiply(tint, weight), m);
    }
    m.extras->specular_tint = s.finish(b.multiply(color, tint), Rgb(1.0f));
    m.ior = s.finish(modulated_ior(b, s.number("specular_ior", 1.5f), weight), Rgb(1.5f));
    m.roughness = s.finish(s.number("specular_roughness", 0.3f), Rgb(0.3f));
    const Port anisotropy = s.number("specular_roughness_anisotropy", 0.0f);
    if (s.can_be_positive(anisotropy)) {
        m.anisotropy = s.finish(anisotropy);
        s.graph.entry.needs_tangents = true;
        s.reject_connected("geometry_tangent");
    }
    read_transmission(s, metalness, tint, m);

    const Port fuzz = s.number("fuzz_weight", 0.0f);
    m.extras->sheen = s.finish(fuzz);
    s.note_neutral("fuzz_weight", fuzz, scene::Effect::Sheen);
    m.extras->sheen_color = s.finish(s.color("fuzz_color", Rgb(1.0f)), Rgb(1.0f));
    m.extras->sheen_roughness = s.finish(s.number("fuzz_roughness", 0.5f), Rgb(0.5f));
    m.emissive_color = s.finish(b.multiply(
        b.multiply(s.color("emission_color", Rgb(1.0f)), s.number("emission_luminance", 0.0f)),
        tint));
    m.normal = s.normal("geometry_normal");
    s.warn_unknown(known_inputs);
    return m;
}

}  // namespace velatura::translate::materials
