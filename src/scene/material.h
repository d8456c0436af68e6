// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

namespace velatura::scene {

/// Which part of a texture's RGBA an input reads.
enum class TextureOutput : uint8_t { R, G, B, A, Rgb };

/// A shader input: a constant, a texture, a primvar or a pattern. Float inputs use value.x.
struct Input {
    enum class Source : uint8_t { Constant, Texture, Primvar, Pattern };
    Source source = Source::Constant;
    Rgb value = Rgb(0.0f);     ///< the constant; also the fallback of a missing primvar
    TextureId texture = none;  ///< Source::Texture
    TextureOutput output = TextureOutput::Rgb;  ///< Source::Texture
    PrimvarId primvar = none;                   ///< Source::Primvar
    PatternId pattern = none;                   ///< Source::Pattern

    Input() = default;

    explicit Input(float v) : value(v) {}

    explicit Input(const Rgb& v) : value(v) {}
};

/// A transparent film on the base, below the coat, so thin that its reflections interfere.
struct ThinFilmInputs {
    Input weight = Input(1.0f);     ///< share of the surface that it covers, [0, 1]
    Input thickness = Input(0.0f);  ///< micrometers
    Input ior = Input(1.4f);
    /// Factor of what metal reflects, with the film and without: MaterialXInputs::metal_f0 and
    /// metal_f90 do not have it where there is a film.
    Input metal_tint = Input(Rgb(1.0f));
};

/// What the surfaces of MaterialX have and UsdPreviewSurface has not. Metal and dielectric differ
/// in color here.
struct MaterialXInputs {
    Input metal_f0 = Input(Rgb(0.0f));   ///< reflectance of what is metallic at normal incidence
    Input metal_f90 = Input(Rgb(1.0f));  ///< and at grazing incidence
    Input specular_tint = Input(Rgb(1.0f));  ///< factor of what a dielectric reflects
    Input coat_ior = Input(1.5f);
    Input diffuse_roughness = Input(0.0f);  ///< of the diffuse base, [0, 1]: EON's r
    Input sheen = Input(0.0f);              ///< weight of the fibers on top of everything, [0, 1]
    Input sheen_color = Input(Rgb(1.0f));
    Input sheen_roughness = Input(0.3f);
    std::optional<ThinFilmInputs> film;
};

/// What light does in a fiber with a scaly surface: what a VelaturaHair shader says
/// (docs/reference/usd_support.md).
struct Hair {
    enum class Absorber : uint8_t { Color, Melanin, Coefficient };
    Absorber absorber =
        Absorber::Melanin;  ///< which of the next three inputs says what the inside absorbs
    Input color = Input(Rgb(0.5f));  ///< of many fibers together, about
    Input eumelanin = Input(1.3f),
          pheomelanin = Input(0.0f);  ///< concentrations; what makes hair dark, and red
    /// Of a concentration of 1 [1/radius]. Ref: d'Eon et al. 2011, section 6.1.
    Rgb eumelanin_absorption = Rgb(0.419f, 0.697f, 1.37f),
        pheomelanin_absorption = Rgb(0.187f, 0.4f, 1.05f);
    Input absorption = Input(Rgb(0.0f));  ///< 1 over the radius of the fiber
    Input roughness = Input(0.3f),
          azimuthal_roughness = Input(0.3f);  ///< along the fiber and around it, [0, 1]
    float ior = 1.55f;
    float cuticle_angle_deg = 2.0f;  ///< by which the scales are tilted
};

/// What fills a solid, by what it does to light [1/scene unit]. Infinite: nothing passes.
struct MediumProperties {
    Rgb absorption = Rgb(0.0f);
    Rgb scattering = Rgb(0.0f);
    float anisotropy = 0.0f;  ///< mean cosine of a scattering (Henyey-Greenstein)
};

/// A UsdPreviewSurface (specification 2.6) with its fallbacks, and what velatura: inputs add to it.
struct Material {
    std::string name;  ///< prim path
    Input diffuse_color = Input(Rgb(0.18f));
    Input emissive_color = Input(Rgb(0.0f));
    bool use_specular_workflow = false;
    Input specular_color = Input(Rgb(0.0f));
    Input metallic = Input(0.0f);
    Input roughness = Input(0.5f);
    Input clearcoat = Input(0.0f);
    Input clearcoat_roughness = Input(0.01f);
    Input opacity = Input(1.0f);
    float opacity_threshold = 0.0f;
    bool presence = false;  ///< opacityMode = "presence": opacity fades the whole surface instead
                            ///< of transmitting
    Input ior = Input(1.5f);
    /// 1 / Abbe number of the solid, whose index at 587.6 nm is `ior`; 0 = one index for all light.
    float dispersion = 0.0f;
    /// velatura:roughTransmission: roughness also blurs what is transmitted. UsdPreviewSurface
    /// itself never does.
    bool rough_transmission = false;
    /// How much narrower the specular lobe is across the tangent than along it; [0, 1], 0 = not.
    /// The tangent is ∂p/∂s, turned by anisotropy_rotation (1 = once around, from ∂p/∂s towards
    /// ∂p/∂t).
    Input anisotropy = Input(0.0f);
    Input anisotropy_rotation = Input(0.0f);
    /// A sheet without thickness instead of the boundary of a solid: light passes straight, both
    /// sides are alike.
    bool thin_walled = false;
    bool is_solid = false;       ///< said to be no thin wall, also on meshes that are open
    bool is_open_sheet = false;  ///< thin-walled only because the geometry has boundary edges
    /// Thin-walled only: share of the diffuse light that goes to the other side, and its albedo;
    /// none = diffuse_color.
    Input diffuse_transmission = Input(0.0f);
    std::optional<Input> diffuse_transmission_color;
    /// With transmission_depth > 0 the solid absorbs: after this distance (scene units)
    /// transmission_color, a constant, is left of white light. Else it multiplies what crosses the
    /// surface; of a thin wall it is what passes perpendicularly once.
    Input transmission_color = Input(Rgb(1.0f));
    float transmission_depth = 0.0f;
    /// With transmission_depth > 0: how much of light, about, is scattered inside within that
    /// distance, ≥ 0 and may exceed 1.
    Rgb transmission_scatter = Rgb(0.0f);
    float transmission_anisotropy = 0.0f;  ///< mean cosine of such a scattering
    std::optional<MediumProperties>
        interior;  ///< fills the solid in place of what the inputs of transmission say
    /// There is no surface: light goes straight on between what is outside and what the solid is
    /// filled with.
    bool is_bare = false;
    /// Where solids overlap the one of the largest number fills the space; among equals the one
    /// that was entered last.
    int dielectric_priority = 0;
    /// How much of what would scatter at the diffuse base scatters inside the solid instead, closed
    /// meshes only. Its color is that of a large flat piece of it (none = diffuse_color), its
    /// radius the way between two scatterings [scene units].
    Input subsurface = Input(0.0f);
    std::optional<Input> subsurface_color;
    Input subsurface_radius = Input(Rgb(1.0f));
    float subsurface_anisotropy = 0.0f;  ///< mean cosine of a scattering
    /// false: no specular at all, pure Lambert; what shapes without a material get with their
    /// displayColor.
    bool has_specular = true;
    Input normal =
        Input(Rgb(0.0f, 0.0f, 1.0f));  ///< tangent space, already scaled and biased into [-1, 1]
    Input displacement = Input(0.0f);  ///< along the normal, scene units
    std::optional<MaterialXInputs> extras;
    std::optional<Hair> hair;  ///< of curves, which take nothing else from the material; all else
                               ///< shows the rest of it
    ProvenanceId provenance = none;
};

inline bool is_constant(const Input& input) {
    return input.source == Input::Source::Constant;
}

/// Calls visit(Input&) for every input that may vary.
template <class Material, class Visitor>
void for_each_input(Material& m, Visitor visit) {
    for (auto* input :
         {&m.diffuse_color, &m.emissive_color, &m.specular_color, &m.metallic, &m.roughness,
          &m.clearcoat, &m.clearcoat_roughness, &m.opacity, &m.ior, &m.anisotropy,
          &m.anisotropy_rotation, &m.diffuse_transmission, &m.transmission_color, &m.subsurface,
          &m.subsurface_radius, &m.normal, &m.displacement})
        visit(*input);
    if (m.subsurface_color) visit(*m.subsurface_color);
    if (m.diffuse_transmission_color) visit(*m.diffuse_transmission_color);
    if (m.hair) {
        for (auto* input : {&m.hair->color, &m.hair->eumelanin, &m.hair->pheomelanin,
                            &m.hair->absorption, &m.hair->roughness, &m.hair->azimuthal_roughness})
            visit(*input);
    }
    if (!m.extras) return;
    auto& x = *m.extras;
    for (auto* input : {&x.metal_f0, &x.metal_f90, &x.specular_tint, &x.coat_ior,
                        &x.diffuse_roughness, &x.sheen, &x.sheen_color, &x.sheen_roughness})
        visit(*input);
    if (!x.film) return;
    for (auto* input : {&x.film->weight, &x.film->thickness, &x.film->ior, &x.film->metal_tint})
        visit(*input);
}

/// Opacity cuts holes: somewhere the surface may not be there at all.
inline bool can_cut(const Material& m) {
    if (!m.presence && !(m.opacity_threshold > 0.0f)) return false;
    const float full = m.opacity_threshold > 0.0f ? m.opacity_threshold : 1.0f;
    return !(is_constant(m.opacity) && m.opacity.value.x >= full);
}

/// Opacity lets light through what is there.
inline bool can_transmit(const Material& m) {
    if (m.presence || m.opacity_threshold > 0.0f) return false;
    return !(is_constant(m.opacity) && m.opacity.value.x >= 1.0f);
}

inline bool can_transmit_diffusely(const Material& m) {
    return m.thin_walled &&
           !(is_constant(m.diffuse_transmission) && !(m.diffuse_transmission.value.x > 0.0f));
}

/// Light may scatter inside what the material bounds.
inline bool can_scatter_below(const Material& m) {
    return !m.thin_walled && !m.hair &&
           !(is_constant(m.subsurface) && !(m.subsurface.value.x > 0.0f));
}

/// The material bounds a solid that displaces others, or is displaced, by more than the order in
/// which they are entered.
inline bool has_priority(const Material& m) {
    return m.dielectric_priority != 0 && can_transmit(m) && !m.thin_walled;
}

/// What light meets inside of what the material bounds: nothing for most.
MediumProperties medium_properties_inside(const Material& m);

/// The material bounds a solid that is not clear inside, whatever scatters there.
inline bool can_absorb(const Material& m) {
    if (!can_transmit(m) || m.thin_walled) return false;
    if (m.interior) return !is_black(m.interior->absorption);
    const Rgb& c = m.transmission_color.value;
    return m.transmission_depth > 0.0f && (c.x < 1.0f || c.y < 1.0f || c.z < 1.0f);
}

/// The material bounds a solid in which light scatters.
inline bool scatters_inside(const Material& m) {
    return !is_black(medium_properties_inside(m).scattering);
}

inline bool can_have_sheen(const Material& m) {
    return m.extras && !(is_constant(m.extras->sheen) && !(m.extras->sheen.value.x > 0.0f)) &&
           !(is_constant(m.extras->sheen_color) && is_black(m.extras->sheen_color.value));
}

inline bool can_have_rough_base(const Material& m) {
    return m.extras && !(is_constant(m.extras->diffuse_roughness) &&
                         !(m.extras->diffuse_roughness.value.x > 0.0f));
}

inline bool can_have_film(const Material& m) {
    if (!m.extras || !m.extras->film) return false;
    const auto can_be_positive = [](const Input& i) { return !is_constant(i) || i.value.x > 0.0f; };
    return can_be_positive(m.extras->film->weight) && can_be_positive(m.extras->film->thickness);
}

/// The material bounds a solid that refracts each wavelength by an index of its own.
inline bool is_dispersive(const Material& m) {
    return m.dispersion > 0.0f && can_transmit(m) && !m.thin_walled && m.has_specular &&
           !(is_constant(m.ior) && m.ior.value.x == 1.0f);
}

/// Whether surfaces of the material move somewhere.
inline bool is_displacing(const Material& material) {
    const Input& d = material.displacement;
    return d.source != Input::Source::Constant || (d.value.x != 0.0f && std::isfinite(d.value.x));
}

/// Whether surfaces of the material emit somewhere: they are lights then.
inline bool is_emissive(const Material& material) {
    const Input& color = material.emissive_color;
    return color.source != Input::Source::Constant || !is_black(color.value);
}

}  // namespace velatura::scene
