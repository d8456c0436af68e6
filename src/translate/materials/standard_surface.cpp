// SPDX-License-Identifier: Apache-2.0
// Standard Surface. Ref: Georgiev et al. 2019, "Autodesk Standard Surface" 1.0.1, and the node
// graph of MaterialX 1.38, standard_surface.mtlx.
#include "translate/materials/node_surface.h"
#include "translate/materials/pattern_builder.h"

#include <array>

namespace velatura::translate::materials {

using scene::PatternOp;

namespace {

constexpr std::array<std::string_view, 42> known_inputs = {"base",
                                                           "base_color",
                                                           "diffuse_roughness",
                                                           "metalness",
                                                           "specular",
                                                           "specular_color",
                                                           "specular_roughness",
                                                           "specular_IOR",
                                                           "specular_anisotropy",
                                                           "specular_rotation",
                                                           "transmission",
                                                           "transmission_color",
                                                           "transmission_depth",
                                                           "transmission_scatter",
                                                           "transmission_scatter_anisotropy",
                                                           "transmission_dispersion",
                                                           "transmission_extra_roughness",
                                                           "subsurface",
                                                           "subsurface_color",
                                                           "subsurface_radius",
                                                           "subsurface_scale",
                                                           "subsurface_anisotropy",
                                                           "sheen",
                                                           "sheen_color",
                                                           "sheen_roughness",
                                                           "coat",
                                                           "coat_color",
                                                           "coat_roughness",
                                                           "coat_anisotropy",
                                                           "coat_rotation",
                                                           "coat_IOR",
                                                           "coat_normal",
                                                           "coat_affect_color",
                                                           "coat_affect_roughness",
                                                           "thin_film_thickness",
                                                           "thin_film_IOR",
                                                           "emission",
                                                           "emission_color",
                                                           "opacity",
                                                           "thin_walled",
                                                           "normal",
                                                           "tangent"};

/// Reflectance at a cosine of 1/7 of the conductor that reflects `r` at normal incidence and has
/// the edge tint `g`, by its refractive index n + ik.
/// Ref: Gulbrandsen 2014, "Artist Friendly Metallic Fresnel", JCGT 3(4).
Port conductor_at_82(PatternBuilder& b, Port color, Port g) {
    const Port one = b.constant(1.0f), c = b.constant(1.0f / 7.0f);
    const Port r = b.clamp(color, b.constant(0.0f), b.constant(0.999f));
    const Port root = b.apply(PatternOp::SquareRoot, 3, {r});
    const Port n = b.mix(b.divide(b.add(one, root), b.subtract(one, root)),
                         b.divide(b.subtract(one, r), b.add(one, r)), g);
    const Port up = b.add(n, one), down = b.subtract(n, one);
    const Port k2 = b.divide(b.subtract(b.multiply(b.multiply(up, up), r), b.multiply(down, down)),
                             b.subtract(one, r));
    const Port square = b.add(b.multiply(n, n), k2);
    const Port across = b.multiply(b.multiply(b.constant(2.0f), n), c), c2 = b.multiply(c, c);
    const Port s_sum = b.add(square, c2);
    const Port s = b.divide(b.subtract(s_sum, across), b.add(s_sum, across));
    const Port p_sum = b.add(b.multiply(square, c2), one);
    const Port p = b.divide(b.subtract(p_sum, across), b.add(p_sum, across));
    return b.multiply(b.add(s, p), b.constant(0.5f));
}

/// What the coat does to all that is below it.
struct Coat {
    Port weight, tint;
    Port gamma;      ///< exponent of colors: coat_affect_color
    Port roughness;  ///< share of full roughness that is mixed in: coat_affect_roughness
};

Coat read_coat(SurfaceReader& s, scene::Material& m) {
    PatternBuilder& b = s.builder();
    const Port weight = s.number("coat", 0.0f), roughness = s.number("coat_roughness", 0.1f);
    m.clearcoat = s.finish(weight);
    s.note_neutral("coat", weight, scene::Effect::Clearcoat);
    m.clearcoat_roughness = s.finish(roughness, Rgb(0.1f));
    m.extras->coat_ior = s.finish(s.number("coat_IOR", 1.5f), Rgb(1.5f));
    if (s.can_be_positive(weight)) {
        s.reject("coat_anisotropy", 0.0f);
        s.reject_connected("coat_normal");
    }
    const Port share = b.clamp(weight, b.constant(0.0f), b.constant(1.0f));
    return {weight, b.mix(b.color(Rgb(1.0f)), s.color("coat_color", Rgb(1.0f)), share),
            b.add(b.constant(1.0f), b.multiply(share, s.number("coat_affect_color", 0.0f))),
            b.multiply(b.multiply(share, s.number("coat_affect_roughness", 0.0f)), roughness)};
}

/// The widths αx = r² / √(1 − 0.9a), αy = r²·√(1 − 0.9a) in terms of OpenPBR's roughness and
/// anisotropy, which the scene has.
void read_microfacets(SurfaceReader& s, const Coat& coat, scene::Material& m) {
    PatternBuilder& b = s.builder();
    Port roughness = b.mix(s.number("specular_roughness", 0.2f), b.constant(1.0f), coat.roughness);
    const Port anisotropy = s.number("specular_anisotropy", 0.0f);
    if (s.can_be_positive(anisotropy)) {
        const Port stretch = b.multiply(anisotropy, b.constant(0.9f));
        const Port ratio = b.invert(stretch);
        const Port both =
            b.multiply(b.add(b.constant(1.0f), b.multiply(ratio, ratio)), b.constant(0.5f));
        const Port factor =
            b.apply(PatternOp::Power, 1, {b.divide(both, ratio), b.constant(0.25f)});
        roughness = b.multiply(roughness, factor);
        m.anisotropy = s.finish(stretch);
        m.anisotropy_rotation = s.finish(s.number("specular_rotation", 0.0f));
        s.graph.entry.needs_tangents = true;
        s.reject_connected("tangent");
    }
    m.roughness = s.finish(roughness, Rgb(0.2f));
}

void read_transmission(SurfaceReader& s, Port metalness, const Coat& coat, scene::Material& m) {
    PatternBuilder& b = s.builder();
    m.thin_walled = s.graph.constant_number(s.shader, "thin_walled", 0.0) != 0.0;
    const Port share = b.multiply(s.number("transmission", 0.0f), b.invert(metalness));
    const Port opacity = s.numbers("opacity", Rgb(1.0f));
    const Port presence = b.dot(opacity, b.color(Rgb(0.2722287f, 0.6740818f, 0.0536895f)));
    const bool is_whole = b.is_constant(opacity, 1.0f);
    s.note_neutral("transmission", share, scene::Effect::Transmission);
    if (!s.can_be_positive(share)) {
        if (is_whole) return;
        m.presence = true;
        m.opacity = s.finish(presence, Rgb(1.0f));
        return;
    }
    if (!is_whole)
        s.graph.ctx.warn(
            "unsupported-input", s.shader.attribute("inputs:opacity"),
            "inputs:opacity is not supported together with inputs:transmission; it is ignored");
    m.opacity = s.finish(b.invert(share), Rgb(1.0f));
    m.rough_transmission = true;
    m.transmission_depth = float(s.graph.constant_number(s.shader, "transmission_depth", 0.0));
    if (m.thin_walled) m.transmission_depth = 0;
    Port color = s.color("transmission_color", Rgb(1.0f));
    // What absorbs is the solid, not the coat on it
    if (!(m.transmission_depth > 0.0f)) color = b.multiply(color, coat.tint);
    m.transmission_color = s.finish(color, Rgb(1.0f));
    s.read_scatter(m);
    if (!m.thin_walled && s.is_authored("transmission_dispersion"))
        s.read_abbe_number("transmission_dispersion", 0.0, 1.0, m);
    s.reject("transmission_extra_roughness", 0.0f);
}

}  // namespace

scene::Material read_standard_surface(SurfaceReader& s) {
    PatternBuilder& b = s.builder();
    scene::Material m;
    m.extras.emplace();
    const Coat coat = read_coat(s, m);
    const Port metalness = s.number("metalness", 0.0f), base = s.number("base", 1.0f);
    const Port base_color = s.color("base_color", Rgb(0.8f));
    const auto under_coat = [&](Port color) {
        const Port positive = b.apply(PatternOp::Maximum, 3, {color, b.constant(0.0f)});
        return b.is_constant(coat.gamma, 1.0f)
                   ? color
                   : b.apply(PatternOp::Power, 3, {positive, coat.gamma});
    };

    // Diffuse base, and what lies deeper than it
    Port diffuse = b.multiply(under_coat(base_color), base);
    const Port subsurface = s.number("subsurface", 0.0f);
    m.thin_walled = s.graph.constant_number(s.shader, "thin_walled", 0.0) != 0.0;
    m.is_solid = !m.thin_walled && s.is_authored("thin_walled");
    s.note_neutral("subsurface", subsurface, scene::Effect::Subsurface);
    if (s.can_be_positive(subsurface)) {
        const Port color = under_coat(s.color("subsurface_color", Rgb(1.0f)));
        if (m.thin_walled) {
            m.diffuse_transmission = s.finish(subsurface);
            m.diffuse_transmission_color = s.finish(b.multiply(color, coat.tint));
        } else {
            m.subsurface = s.finish(subsurface);
            m.subsurface_color = s.finish(b.multiply(color, coat.tint), Rgb(1.0f));
            m.subsurface_radius = s.finish(b.multiply(s.numbers("subsurface_radius", Rgb(1.0f)),
                                                      s.number("subsurface_scale", 1.0f)),
                                           Rgb(1.0f));
            m.subsurface_anisotropy =
                float(s.graph.constant_number(s.shader, "subsurface_anisotropy", 0.0));
        }
    }
    m.diffuse_color = s.finish(b.multiply(diffuse, coat.tint), Rgb(0.8f));
    const Port roughness = s.number("diffuse_roughness", 0.0f);
    m.extras->diffuse_roughness = s.finish(roughness);
    s.note_neutral("diffuse_roughness", roughness, scene::Effect::RoughDiffuse);

    // Metal and dielectric
    m.metallic = s.finish(metalness);
    // Nanometers here
    s.read_film({{}, 1.0f}, {"thin_film_thickness", 0.0f}, {"thin_film_IOR", 1.5f},
                b.constant(1e-3f), m);
    const Port specular =
        b.multiply(s.color("specular_color", Rgb(1.0f)), s.number("specular", 1.0f));
    if (s.can_be_positive(metalness)) {
        const Port reflectivity = b.multiply(base_color, base);
        const Port f90 =
            b.is_constant(specular, 1.0f)
                ? b.color(Rgb(1.0f))
                : schlick_f90(b, reflectivity, conductor_at_82(b, reflectivity, specular));
        s.read_metal(reflectivity, f90, coat.tint, m);
    }
    m.extras->specular_tint = s.finish(b.multiply(specular, coat.tint), Rgb(1.0f));
    m.ior = s.finish(s.number("specular_IOR", 1.5f), Rgb(1.5f));
    read_microfacets(s, coat, m);
    read_transmission(s, metalness, coat, m);

    const Port sheen = s.number("sheen", 0.0f);
    m.extras->sheen = s.finish(sheen);
    s.note_neutral("sheen", sheen, scene::Effect::Sheen);
    m.extras->sheen_color =
        s.finish(b.multiply(s.color("sheen_color", Rgb(1.0f)), coat.tint), Rgb(1.0f));
    m.extras->sheen_roughness = s.finish(s.number("sheen_roughness", 0.3f), Rgb(0.3f));
    m.emissive_color = s.finish(b.multiply(
        b.multiply(s.color("emission_color", Rgb(1.0f)), s.number("emission", 0.0f)), coat.tint));
    m.normal = s.normal("normal");
    s.warn_unknown(known_inputs);
    return m;
}

}  // namespace velatura::translate::materials
