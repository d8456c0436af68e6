// SPDX-License-Identifier: Apache-2.0
#include "shading/material_evaluator.h"

#include "geometry/fiber.h"
#include "geometry/geometry_set.h"
#include "geometry/triangle_mesh.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

using geometry::SurfacePoint;
using scene::can_cut;
using scene::can_transmit;
using scene::can_transmit_diffusely;
using scene::count_call;
using scene::Effect;
using scene::Input;
using scene::is_constant;

/// Gray of surfaces without any color (usdImaging's fallback).
constexpr float fallback_gray = 0.5f;

/// v in [0, 1]; NaN counts as 0.
float unit_interval(float v) {
    return v > 0.0f ? std::min(v, 1.0f) : 0.0f;
}

Rgb unit_interval(const Rgb& c) {
    return {unit_interval(c.x), unit_interval(c.y), unit_interval(c.z)};
}

float non_negative(float v) {
    return v > 0.0f && std::isfinite(v) ? v : 0.0f;
}

/// Keeps the index where refraction has a meaning; NaN counts as the fallback 1.5.
float valid_ior(float ior) {
    return std::isnan(ior) ? 1.5f : std::clamp(ior, 1e-3f, 1e3f);
}

Rgb mix(const Rgb& a, const Rgb& b, float t) {
    return a + (b - a) * t;
}

/// Roughness that an input may take on, in [0, 1].
Vec2 range_of(const Input& input) {
    if (!is_constant(input)) return {0.0f, 1.0f};
    return Vec2(unit_interval(input.value.x));
}

scene::Provenance provenance_of(const scene::Scene& scene, const scene::Material& m) {
    return m.provenance < scene.provenance.size() ? scene.provenance[m.provenance]
                                                  : scene::Provenance();
}

/// Says which constants are out of the range that the model can honor.
void check_constants(const scene::Scene& scene,
                     const scene::Material& m,
                     Diagnostics& diagnostics) {
    const scene::Provenance where = provenance_of(scene, m);
    const auto check = [&](const Input& input, const char* name) {
        if (!is_constant(input)) return;
        const Rgb clamped = unit_interval(input.value);
        if (clamped == input.value) return;
        diagnostics.warn("material-out-of-range", where.loc, m.name,
                         std::string("inputs:") + name + " is outside [0, 1] and is clamped");
    };
    check(m.diffuse_color, "diffuseColor");
    if (m.use_specular_workflow) check(m.specular_color, "specularColor");
    check(m.metallic, "metallic");
    check(m.roughness, "roughness");
    check(m.clearcoat, "clearcoat");
    check(m.clearcoat_roughness, "clearcoatRoughness");
    check(m.opacity, "opacity");
    check(m.anisotropy, "velatura:anisotropy");
    check(m.subsurface, "velatura:subsurface");
    if (m.subsurface_color) check(*m.subsurface_color, "velatura:subsurfaceColor");
    check(m.diffuse_transmission, "velatura:diffuseTransmission");
    if (m.diffuse_transmission_color)
        check(*m.diffuse_transmission_color, "velatura:diffuseTransmissionColor");
    check(m.transmission_color, "velatura:transmissionColor");
}

/// Makes the index that of a solid within another, and finds what blurs light there.
void set_surroundings(const std::vector<const RoughInterface*>& interfaces,
                      float surrounding_index,
                      SurfaceParameters& p) {
    p.ior /= surrounding_index;
    p.interface = nullptr;
    for (const RoughInterface* interface : interfaces)
        if (interface->ior() == p.ior) p.interface = interface;
}

/// Texture coordinates per render-space unit around a point, as the root of the ratio of areas; 0
/// when unknown.
double texture_density(const scene::Scene& scene, const SurfacePoint& point, scene::PrimvarId st) {
    // What is not made of triangles has no coordinates that vary
    float corners[3][4] = {};
    if (point.mesh->primitives() || !point.mesh->primvar_corners(st, point.triangle, corners))
        return 0.0;
    const auto corner = [&](int k) {
        return Vec3d(point.mesh->corner(point.triangle, k, point.time));
    };
    Vec3d e1 = corner(1) - corner(0), e2 = corner(2) - corner(0);
    if (point.instance != scene::none) {
        const Mat4d m(geometry::render_from_prototype(scene.instances[point.instance], point.time));
        e1 = transform_direction(e1, m);
        e2 = transform_direction(e2, m);
    }
    const Vec3d n = e1.cross(e2);
    const double area = std::sqrt(n.dot(n));
    const double s1 = double(corners[1][0]) - double(corners[0][0]);
    const double t1 = double(corners[1][1]) - double(corners[0][1]);
    const double s2 = double(corners[2][0]) - double(corners[0][0]);
    const double t2 = double(corners[2][1]) - double(corners[0][1]);
    return area > 0.0 ? std::sqrt(std::abs(s1 * t2 - s2 * t1) / area) : 0.0;
}

}  // namespace

MaterialEvaluator::MaterialEvaluator(const scene::Scene& scene,
                                     Diagnostics& diagnostics,
                                     scene::EffectSet forced,
                                     float texture_bias,
                                     size_t texture_bytes)
    : scene_(scene),
      forced_(forced),
      texture_width_(std::exp2(texture_bias)),
      textures_(texture_bytes),
      display_color_(scene::find_primvar(scene, scene::display_color_primvar)),
      display_opacity_(scene::find_primvar(scene, scene::display_opacity_primvar)) {
    texture_handles_.reserve(scene.textures.size());
    for (const scene::Texture& t : scene.textures) {
        scene::Provenance where;
        if (t.provenance < scene.provenance.size()) where = scene.provenance[t.provenance];
        texture_handles_.push_back(textures_.open(t, where.loc, where.prim_path, diagnostics));
    }
    update(diagnostics);
}

void MaterialEvaluator::update(Diagnostics& diagnostics) {
    const scene::Scene& scene = scene_;
    const scene::EffectSet forced = forced_;
    wavelength_bands_ = wavelength_bands(scene.settings.working_space);
    flags_.clear();
    has_presence_ = has_emission_ = is_see_through_ = has_absorption_ = has_interior_media_ =
        has_priorities_ = has_subsurface_ = has_dispersion_ = false;
    for (const scene::Material& m : scene.materials) {
        check_constants(scene, m, diagnostics);
        Flags f;
        f.has_presence = can_cut(m) || forced.has(Effect::Cutouts);
        set_transport(m, f, diagnostics);
        f.turns_normals = !is_constant(m.normal) || m.normal.value != Rgb(0.0f, 0.0f, 1.0f);
        if (scene::can_have_sheen(m)) sheen_ = &SheenAlbedo::of_process();
        f.has_film = scene::can_have_film(m);
        if (f.has_film) {
            film_ = &FilmTables::of_process(scene.settings.working_space);
            f.film_curve = make_film_curve(m);
        }
        f.is_dispersive = scene::is_dispersive(m);
        has_dispersion_ = has_dispersion_ || f.is_dispersive;
        f.is_emissive = scene::is_emissive(m);
        f.is_hair = m.hair.has_value();
        f.has_subsurface = scene::can_scatter_below(m);
        f.is_special = f.interface != nullptr || f.anisotropic != nullptr || m.thin_walled ||
                       m.extras.has_value() || f.has_subsurface || can_transmit(m) ||
                       !is_constant(m.clearcoat) || m.clearcoat.value.x > 0.0f;
        has_subsurface_ = has_subsurface_ || f.has_subsurface;
        flags_.push_back(f);
        has_presence_ = has_presence_ || f.has_presence;
        is_see_through_ = is_see_through_ || f.is_see_through;
        has_interior_media_ = has_interior_media_ || f.scatters_inside || f.is_bare;
        has_absorption_ = has_absorption_ || !is_black(f.extinction) || f.is_bare;
        has_emission_ = has_emission_ || f.is_emissive;
    }
    Flags display;
    display.has_presence = scene::can_cut_display(scene) || forced.has(Effect::Cutouts);
    has_presence_ = has_presence_ || display.has_presence;
    is_see_through_ = is_see_through_ || forced.has(Effect::ThinWalls);
    has_interior_media_ = has_interior_media_ || forced.has(Effect::InteriorMedia);
    has_absorption_ = has_absorption_ || has_interior_media_ || forced.has(Effect::Absorption);
    flags_.push_back(display);
    has_priorities_ =
        std::any_of(scene.materials.begin(), scene.materials.end(), scene::has_priority);
    if (has_priorities_) set_priorities(diagnostics);
}

MaterialEvaluator::~MaterialEvaluator() = default;

/// What of the material light may pass, and what lobes of two widths need.
void MaterialEvaluator::set_transport(const scene::Material& m,
                                      Flags& f,
                                      Diagnostics& diagnostics) {
    const bool transmits = can_transmit(m);
    f.has_transmission = transmits || can_transmit_diffusely(m);
    f.bounds_solid = transmits && !m.thin_walled;
    f.is_bare = m.is_bare && f.bounds_solid;
    f.anisotropic = make_anisotropy(m);
    if (!transmits) return;
    const bool has_index_one = is_constant(m.ior) && m.ior.value.x == 1.0f;
    f.is_see_through = m.thin_walled || has_index_one;
    if (f.bounds_solid && m.rough_transmission)
        f.interface = make_interface(m, f, 1.0f, diagnostics);
    const scene::MediumProperties inside = scene::medium_properties_inside(m);
    f.extinction = inside.absorption + inside.scattering;
    f.scatters_inside = scene::scatters_inside(m);
    if (!f.bounds_solid || m.interior || !(m.transmission_depth > 0.0f)) return;
    if (!is_constant(m.transmission_color)) {
        diagnostics.warn("absorption", provenance_of(scene_, m).loc, m.name,
                         "inputs:velatura:transmissionColor cannot vary inside a solid "
                         "(inputs:velatura:transmissionDepth is above 0); its fallback is used");
    }
}

/// What solids that displace each other by priority need to know of each other.
void MaterialEvaluator::set_priorities(Diagnostics& diagnostics) {
    // Rays go through what lies in a solid of a higher priority, and ask what they are inside of
    has_absorption_ = is_see_through_ = true;
    for (size_t i = 0; i < scene_.materials.size(); ++i) {
        const scene::Material& m = scene_.materials[i];
        if (!flags_[i].bounds_solid) continue;
        flags_[i].priority = m.dielectric_priority;
        flags_[i].index = valid_ior(m.ior.value.x);
        if (!is_constant(m.ior))
            diagnostics.warn("nested-bodies", provenance_of(scene_, m).loc, m.name,
                             "inputs:ior varies; solids inside or around this one that have "
                             "dielectric priorities use its fallback");
    }
    for (size_t i = 0; i < scene_.materials.size(); ++i) {
        Flags& f = flags_[i];
        if (!f.interface) continue;
        for (size_t k = 0; k < scene_.materials.size(); ++k) {
            if (k == i || !flags_[k].bounds_solid) continue;
            if (const RoughInterface* within =
                    make_interface(scene_.materials[i], f, flags_[k].index, diagnostics))
                f.interfaces_within.push_back(within);
        }
    }
}

/// Null where the lobe has one width: everywhere, or as there is none.
const AnisotropicAlbedo* MaterialEvaluator::make_anisotropy(const scene::Material& m) {
    const Vec2 anisotropy = range_of(m.anisotropy), roughness = range_of(m.roughness);
    if (!(anisotropy.y > 0.0f) || !m.has_specular) return nullptr;
    // αx grows with both
    const Vec2 narrow = anisotropic_alpha(roughness.x, anisotropy.x);
    const Vec2 wide = anisotropic_alpha(roughness.y, anisotropy.y);
    if (wide.x < specular_switch_alpha) return nullptr;
    AnisotropyRange range;
    range.alpha_low = std::max(narrow.x, specular_switch_alpha);
    range.alpha_high = std::max(wide.x, specular_switch_alpha);
    const float min_ratio = min_alpha / range.alpha_high;
    range.ratio_low = std::max(1.0f - anisotropy.y, min_ratio);
    range.ratio_high = std::max(1.0f - anisotropy.x, min_ratio);
    for (const auto& made : anisotropies_) {
        if (made->range() == range) return made.get();
    }
    anisotropies_.push_back(std::make_unique<AnisotropicAlbedo>(range));
    return anisotropies_.back().get();
}

/// Null where the film, or what it lies on, varies.
std::shared_ptr<const FilmCurve> MaterialEvaluator::make_film_curve(
    const scene::Material& m) const {
    const scene::MaterialXInputs& x = *m.extras;
    for (const Input* input :
         {&x.film->thickness, &x.film->ior, &x.film->metal_tint, &x.specular_tint, &x.coat_ior,
          &x.metal_f0, &x.metal_f90, &m.ior, &m.metallic, &m.clearcoat, &m.opacity})
        if (!is_constant(*input)) return nullptr;
    SurfaceParameters p;
    p.clearcoat = unit_interval(m.clearcoat.value.x);
    p.coat_ior = valid_ior(x.coat_ior.value.x);
    if (can_transmit(m)) p.opacity = unit_interval(m.opacity.value.x);
    FilmParameters film = film_parameters(m, SurfacePoint(), 0.0f, 1.0f, p);
    film.weight = 1.0f;
    const FilmFresnel fresnel(film, Rgb(0.0f), Rgb(1.0f));
    return std::make_shared<const FilmCurve>([&](float cosine) { return fresnel.covered(cosine); });
}

const RoughInterface* MaterialEvaluator::make_interface(const scene::Material& m,
                                                        const Flags& f,
                                                        float surrounding_index,
                                                        Diagnostics& diagnostics) {
    const SourceLoc where = provenance_of(scene_, m).loc;
    if (!is_constant(m.ior)) {
        diagnostics.warn("rough-transmission", where, m.name,
                         "inputs:velatura:roughTransmission needs a constant inputs:ior; light is "
                         "transmitted without blur");
        return nullptr;
    }
    const float ior = valid_ior(m.ior.value.x) / surrounding_index;
    float low = specular_switch_alpha, high = 1.0f;
    if (is_constant(m.roughness)) {
        const float roughness = unit_interval(m.roughness.value.x);
        low = high = roughness * roughness;
    }
    // Without roughness or without an interface there is nothing to blur
    if (ior == 1.0f || !m.has_specular) return nullptr;
    if (f.anisotropic) {
        const AnisotropyRange& range = f.anisotropic->range();
        if (range.alpha_low < range.alpha_high || range.ratio_low < range.ratio_high) {
            diagnostics.warn(
                "rough-transmission", where, m.name,
                "inputs:velatura:roughTransmission needs constant inputs:roughness and "
                "inputs:velatura:anisotropy where these are not 0; light is "
                "transmitted without blur");
            return nullptr;
        }
        for (const auto& made : interfaces_) {
            if (made->ior() == ior && made->anisotropic() == f.anisotropic) return made.get();
        }
        const Vec2 alpha = f.anisotropic->alpha();
        interfaces_.push_back(std::make_unique<RoughInterface>(ior, alpha, f.anisotropic));
        return interfaces_.back().get();
    }
    if (high < specular_switch_alpha) return nullptr;
    for (const auto& made : interfaces_) {
        if (made->ior() == ior && made->alpha_low() == low && made->alpha_high() == high &&
            made->anisotropic() == nullptr)
            return made.get();
    }
    interfaces_.push_back(std::make_unique<RoughInterface>(ior, low, high));
    return interfaces_.back().get();
}

TexelRgba MaterialEvaluator::texture(scene::TextureId id,
                                     const SurfacePoint& point,
                                     float footprint) const {
    count_call(Effect::Textures);
    const scene::Texture& t = scene_.textures[id];
    if (t.fallback_primvar != scene::none && !textures_.is_valid(texture_handles_[id])) {
        TexelRgba out = t.fallback;
        geometry::primvar(scene_, point, t.fallback_primvar, out.data());
        return out;
    }
    float st[4] = {t.st_constant.x, t.st_constant.y, 0, 0};
    Vec2 width(0.0f);
    if (t.st != scene::none) {
        // Without the coordinates that it asks for the texture reads its constant ones
        geometry::primvar(scene_, point, t.st, st);
        if (footprint > 0.0f && point.mesh != nullptr) {
            const double w =
                double(footprint) * double(texture_width_) * texture_density(scene_, point, t.st);
            width = Vec2(float(w * std::hypot(double(t.st_matrix[0]), double(t.st_matrix[2]))),
                         float(w * std::hypot(double(t.st_matrix[1]), double(t.st_matrix[3]))));
        }
    }
    const Vec2 mapped(st[0] * t.st_matrix[0] + st[1] * t.st_matrix[2] + t.st_offset.x,
                      st[0] * t.st_matrix[1] + st[1] * t.st_matrix[3] + t.st_offset.y);
    return textures_.lookup(texture_handles_[id], mapped, width);
}

Rgb MaterialEvaluator::varying(const Input& input,
                               const SurfacePoint& point,
                               float footprint) const {
    switch (input.source) {
        case Input::Source::Constant:
            return input.value;
        case Input::Source::Primvar: {
            count_call(Effect::VaryingColors);
            float out[4] = {input.value.x, input.value.y, input.value.z, 0};
            geometry::primvar(scene_, point, input.primvar, out);
            return {out[0], out[1], out[2]};
        }
        case Input::Source::Pattern: {
            const scene::PatternValue v = pattern(input.pattern, point, footprint);
            return {v.x, v.y, v.z};
        }
        case Input::Source::Texture: {
            const TexelRgba c = texture(input.texture, point, footprint);
            switch (input.output) {
                case scene::TextureOutput::R:
                    return Rgb(c[0]);
                case scene::TextureOutput::G:
                    return Rgb(c[1]);
                case scene::TextureOutput::B:
                    return Rgb(c[2]);
                case scene::TextureOutput::A:
                    return Rgb(c[3]);
                case scene::TextureOutput::Rgb:
                    return {c[0], c[1], c[2]};
            }
        }
    }
    return input.value;
}

float MaterialEvaluator::displacement(const SurfacePoint& point, float footprint) const {
    const float d = scalar(scene_.materials[point.material].displacement, point, footprint);
    return std::isfinite(d) ? d : 0.0f;
}

Rgb MaterialEvaluator::display_color(const SurfacePoint& point) const {
    float out[4] = {fallback_gray, fallback_gray, fallback_gray, 1};
    if (display_color_ != scene::none && geometry::primvar(scene_, point, display_color_, out))
        count_call(Effect::VaryingColors);
    return unit_interval(Rgb(out[0], out[1], out[2]));
}

SurfaceParameters MaterialEvaluator::parameters(scene::MaterialId material,
                                                const SurfacePoint& point,
                                                float footprint,
                                                float surrounding_index,
                                                float spread) const {
    const scene::Material& m = scene_.materials[material];
    SurfaceParameters p;
    const Flags& f = flags_[material];
    p.interface = f.interface;
    const Rgb base = unit_interval(color(m.diffuse_color, point, footprint));
    p.ior = valid_ior(scalar(m.ior, point, footprint));
    const float index = p.ior;
    if (surrounding_index != 1.0f) set_surroundings(f.interfaces_within, surrounding_index, p);
    if (m.use_specular_workflow) {
        p.diffuse = base;
        p.f0 = unit_interval(color(m.specular_color, point, footprint));
        p.f90 = Rgb(1.0f);
    } else {
        const float metallic = unit_interval(scalar(m.metallic, point, footprint));
        const float r = (1.0f - p.ior) / (1.0f + p.ior);
        p.diffuse = base * (1.0f - metallic);
        p.f0 = mix(Rgb(r * r), base, metallic);
        // No interface, no reflection: index 1 would be visible at grazing angles by Schlick's
        // formula alone
        p.f90 = mix(Rgb(p.ior == 1.0f ? 0.0f : 1.0f), base, metallic);
    }
    if (!m.has_specular) p.f0 = p.f90 = Rgb(0.0f);
    const float roughness = unit_interval(scalar(m.roughness, point, footprint));
    p.alpha = roughness * roughness;
    if (f.is_special) add_special(m, f, point, footprint, p);
    // What is reflected has the index of no wavelength of its own
    if (spread != 0.0f && f.is_dispersive)
        p.ior *= dispersed_index(index, m.dispersion, spread) / index;
    return p;
}

void MaterialEvaluator::add_special(const scene::Material& m,
                                    const Flags& f,
                                    const SurfacePoint& point,
                                    float footprint,
                                    SurfaceParameters& p) const {
    if (f.has_subsurface) p.diffuse *= 1.0f - subsurface_weight(m, point, footprint);
    p.clearcoat = unit_interval(scalar(m.clearcoat, point, footprint));
    if (p.clearcoat > 0.0f) {
        count_call(Effect::Clearcoat);
        const float coat = unit_interval(scalar(m.clearcoat_roughness, point, footprint));
        p.clearcoat_alpha = coat * coat;
    }
    if (can_transmit(m)) {
        count_call(Effect::Transmission);
        p.opacity = unit_interval(scalar(m.opacity, point, footprint));
    }
    if (p.interface) count_call(Effect::RoughTransmission);
    if (m.extras) {
        const float metallic = unit_interval(scalar(m.metallic, point, footprint));
        add_extras(*m.extras, point, footprint, metallic, p);
    }
    if (f.anisotropic) add_anisotropy(m, point, footprint, p);
    if (m.thin_walled) add_thin_wall(m, point, footprint, p);
    if (p.opacity < 1.0f && (m.thin_walled || !(m.transmission_depth > 0.0f)))
        p.transmission_tint = unit_interval(color(m.transmission_color, point, footprint));
}

void MaterialEvaluator::add_extras(const scene::MaterialXInputs& x,
                                   const SurfacePoint& point,
                                   float footprint,
                                   float metallic,
                                   SurfaceParameters& p) const {
    const float r = (1.0f - p.ior) / (1.0f + p.ior);
    const Rgb tint = unit_interval(color(x.specular_tint, point, footprint));
    p.f0 = tint * (r * r);
    p.f90 = p.ior == 1.0f ? Rgb(0.0f) : tint;
    if (metallic > 0.0f) {
        Rgb f0 = unit_interval(color(x.metal_f0, point, footprint));
        Rgb f90 = unit_interval(color(x.metal_f90, point, footprint));
        if (x.film) {
            const Rgb metal_tint = unit_interval(color(x.film->metal_tint, point, footprint));
            f0 *= metal_tint;
            f90 *= metal_tint;
        }
        p.f0 = mix(p.f0, f0, metallic);
        p.f90 = mix(p.f90, f90, metallic);
    }
    if (p.clearcoat > 0.0f) p.coat_ior = valid_ior(scalar(x.coat_ior, point, footprint));
    p.diffuse_roughness = unit_interval(scalar(x.diffuse_roughness, point, footprint));
    if (p.diffuse_roughness > 0.0f) count_call(Effect::RoughDiffuse);
    if (sheen_ == nullptr) return;
    const float sheen = unit_interval(scalar(x.sheen, point, footprint));
    if (!(sheen > 0.0f)) return;
    count_call(Effect::Sheen);
    p.sheen = sheen_;
    p.sheen_color = unit_interval(color(x.sheen_color, point, footprint)) * sheen;
    p.sheen_roughness = std::max(unit_interval(scalar(x.sheen_roughness, point, footprint)),
                                 SheenAlbedo::min_roughness);
}

/// Of a material that can have one. All indices over that of what light comes from: the side of the
/// smaller index where the surface transmits.
FilmParameters MaterialEvaluator::film_parameters(const scene::Material& m,
                                                  const SurfacePoint& point,
                                                  float footprint,
                                                  float surrounding_index,
                                                  const SurfaceParameters& p) const {
    const scene::MaterialXInputs& x = *m.extras;
    const scene::ThinFilmInputs& inputs = *x.film;
    FilmParameters film;
    film.tables = film_;
    film.weight = unit_interval(scalar(inputs.weight, point, footprint));
    film.thickness = non_negative(scalar(inputs.thickness, point, footprint));
    film.ior = std::max(valid_ior(scalar(inputs.ior, point, footprint)), 1.0f) / surrounding_index;
    // A coat covers what is around it by its weight
    film.above = p.clearcoat > 0.0f ? 1.0f + (p.coat_ior - 1.0f) * p.clearcoat : 1.0f;
    film.below = valid_ior(scalar(m.ior, point, footprint)) / surrounding_index;
    if (p.opacity < 1.0f && film.below < 1.0f) {
        film.ior /= film.below;
        film.below = film.above / film.below;
        film.above = 1.0f;
    }
    film.tint = unit_interval(color(x.specular_tint, point, footprint));
    film.metallic = unit_interval(scalar(m.metallic, point, footprint));
    if (film.metallic > 0.0f) {
        film.metal_f0 = unit_interval(color(x.metal_f0, point, footprint));
        film.metal_f90 = unit_interval(color(x.metal_f90, point, footprint));
        film.metal_tint = unit_interval(color(inputs.metal_tint, point, footprint));
    }
    return film;
}

void MaterialEvaluator::add_anisotropy(const scene::Material& m,
                                       const SurfacePoint& point,
                                       float footprint,
                                       SurfaceParameters& p) const {
    const float roughness = unit_interval(scalar(m.roughness, point, footprint));
    const float anisotropy = unit_interval(scalar(m.anisotropy, point, footprint));
    const Vec2 alpha = anisotropic_alpha(roughness, anisotropy);
    count_call(Effect::Anisotropy);
    p.anisotropic = flags(point.material).anisotropic;
    p.alpha = alpha.x;
    p.alpha_y = alpha.y;
    // Turn the tangent about the interpolated normal
    const auto [dpds, dpdt] = geometry::tangents(scene_, point);
    const Vec3 along = dpds - point.ns * point.ns.dot(dpds);
    const float length2 = along.dot(along);
    const Vec3 tangent = length2 > 1e-12f ? along / std::sqrt(length2) : Frame::from_z(point.ns).x;
    const float turns = scalar(m.anisotropy_rotation, point, footprint);
    if (!(turns != 0.0f) || !std::isfinite(turns)) {
        p.tangent = tangent;
        return;
    }
    Vec3 across = cross(point.ns, tangent);
    if (across.dot(dpdt) < 0.0f) across = -across;
    const float angle = 2.0f * pi * (turns - std::floor(turns));
    p.tangent = tangent * std::cos(angle) + across * std::sin(angle);
}

void MaterialEvaluator::add_thin_wall(const scene::Material& m,
                                      const SurfacePoint& point,
                                      float footprint,
                                      SurfaceParameters& p) const {
    count_call(Effect::ThinWalls);
    p.is_thin = true;
    p.is_thin_rough = m.rough_transmission;
    if (p.is_thin_rough && p.alpha > 0.0f) count_call(Effect::RoughTransmission);
    if (!can_transmit_diffusely(m)) return;
    count_call(Effect::DiffuseTransmission);
    const float share = unit_interval(scalar(m.diffuse_transmission, point, footprint));
    const Input& input =
        m.diffuse_transmission_color ? *m.diffuse_transmission_color : m.diffuse_color;
    float metallic = 0.0f;
    if (!m.use_specular_workflow) metallic = unit_interval(scalar(m.metallic, point, footprint));
    p.diffuse_transmitted =
        unit_interval(color(input, point, footprint)) * (share * (1.0f - metallic));
    p.diffuse *= 1.0f - share;
}

Vec3 MaterialEvaluator::mapped_normal(const scene::Material& material,
                                      const SurfacePoint& point,
                                      float footprint) const {
    const Rgb n = color(material.normal, point, footprint);
    if (n == Rgb(0.0f, 0.0f, 1.0f)) return point.ns;
    count_call(Effect::NormalMaps);
    // Frame of the texture coordinates in use; green points along ∂p/∂t, also where the coordinates
    // are mirrored
    const Vec3& ns = point.ns;
    const auto [dpds, dpdt] = geometry::tangents(scene_, point);
    Vec3 tangent = dpds - ns * ns.dot(dpds);
    const float length2 = tangent.dot(tangent);
    tangent = length2 > 1e-12f ? tangent / std::sqrt(length2) : Frame::from_z(ns).x;
    Vec3 bitangent = cross(ns, tangent);
    if (bitangent.dot(dpdt) < 0.0f) bitangent = -bitangent;
    const Vec3 mapped = tangent * n.x + bitangent * n.y + ns * n.z;
    if (!is_finite(mapped) || mapped == Vec3(0.0f)) return ns;
    return normalize(mapped);
}

Bsdf MaterialEvaluator::make_bsdf(const SurfacePoint& point,
                                  const Vec3& wo,
                                  float footprint,
                                  float surrounding_index,
                                  float spread) const {
    // What is in front of the smooth surface does not lie below the facet that stands for it
    const Vec3& horizon = point.side != 0 ? point.ns : point.ng;
    if (point.material >= scene_.materials.size()) {
        // displayColor is matt: no specular reflection
        return Bsdf(display_color(point), point.ng, point.ns, wo, horizon);
    }
    const scene::Material& m = scene_.materials[point.material];
    if (m.hair) {
        if (const auto fiber = geometry::fiber_at(scene_, point, wo))
            return Bsdf(hair_parameters(*m.hair, point, footprint), fiber->h, fiber->along,
                        fiber->ng, wo);
    }
    const Flags& f = flags_[point.material];
    const Vec3 ns = f.turns_normals ? mapped_normal(m, point, footprint) : point.ns;
    if (!f.has_film)
        return Bsdf(parameters(point.material, point, footprint, surrounding_index, spread),
                    point.ng, ns, wo, horizon);
    SurfaceParameters p = parameters(point.material, point, footprint, surrounding_index, spread);
    FilmParameters film = film_parameters(m, point, footprint, surrounding_index, p);
    if (surrounding_index == 1.0f) film.curve = f.film_curve.get();
    if (film.weight > 0.0f && film.thickness > 0.0f) {
        count_call(Effect::ThinFilm);
        p.film = &film;
    }
    return Bsdf(p, point.ng, ns, wo, horizon);
}

Rgb MaterialEvaluator::emission(const SurfacePoint& point, const Vec3&, float footprint) const {
    if (!is_emissive(point.material)) return Rgb(0.0f);
    const Rgb e = color(scene_.materials[point.material].emissive_color, point, footprint);
    return {non_negative(e.x), non_negative(e.y), non_negative(e.z)};
}

float MaterialEvaluator::presence(const SurfacePoint& point, float footprint) const {
    if (!material_has_presence(point.material)) return 1.0f;
    count_call(Effect::Cutouts);
    if (point.material >= scene_.materials.size()) {
        float out[4] = {1, 1, 1, 1};
        geometry::primvar(scene_, point, display_opacity_, out);
        return unit_interval(out[0]);
    }
    const scene::Material& m = scene_.materials[point.material];
    if (!can_cut(m)) return 1.0f;
    const float opacity = unit_interval(scalar(m.opacity, point, footprint));
    if (m.opacity_threshold > 0.0f) return opacity >= m.opacity_threshold ? 1.0f : 0.0f;
    return opacity;
}

}  // namespace velatura::shading
