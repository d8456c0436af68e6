// SPDX-License-Identifier: Apache-2.0
#include "integrator/effect_rules.h"

#include <fmt/format.h>

#include <array>
#include <variant>
#include <vector>

namespace velatura::integrator {

using scene::Effect;
using scene::Input;
using scene::is_constant;
using scene::Material;

namespace {

bool is_positive(const Input& input) {
    return !is_constant(input) || input.value.x > 0.0f;
}

/// "opacity 0.4", "opacity of a texture".
std::string named_value(std::string_view name, const Input& input) {
    switch (input.source) {
        case Input::Source::Constant:
            return fmt::format("{} {:g}", name, input.value.x);
        case Input::Source::Texture:
            return fmt::format("{} by a texture", name);
        case Input::Source::Primvar:
            return fmt::format("{} by a primvar", name);
        case Input::Source::Pattern:
            return fmt::format("{} by a node graph", name);
    }
    return {};
}

/// Finds the materials that `is_used` holds of.
template <class Test, class Why>
void find_materials(EffectFindings& found, Test is_used, Why why) {
    for (const Material& m : found.scene.materials)
        if (is_used(m)) found.on(m.name, why(m));
}

bool is_texture(scene::PatternOp op) {
    return op == scene::PatternOp::Texture || op == scene::PatternOp::TextureAt;
}

bool is_primvar(scene::PatternOp op) {
    return op == scene::PatternOp::Primvar;
}

/// Whether an input has the source, or is a pattern with a step of that kind.
bool reads(const scene::Scene& scene,
           const Material& m,
           Input::Source source,
           bool (*is_step)(scene::PatternOp)) {
    bool is_read = false;
    scene::for_each_input(m, [&](const Input& input) {
        if (input.source == source) is_read = true;
        if (input.source != Input::Source::Pattern || is_step == nullptr) return;
        for (const scene::PatternStep& step : scene.patterns[input.pattern].steps)
            is_read = is_read || is_step(step.op);
    });
    return is_read;
}

template <class Change>
void change_materials(scene::Scene& scene, Change change) {
    for (Material& m : scene.materials) change(m);
}

/// Steps of patterns that read something become black.
void forget_steps(scene::Scene& scene, bool (*is_step)(scene::PatternOp)) {
    for (scene::Pattern& pattern : scene.patterns) {
        for (scene::PatternStep& step : pattern.steps) {
            if (!is_step(step.op)) continue;
            step = {
                scene::PatternOp::Constant, 4, {0, 0, 0, 0}, uint32_t(pattern.constants.size())};
            pattern.constants.emplace_back(0.0f);
        }
    }
}

void forget_inputs(scene::Scene& scene, Input::Source source) {
    change_materials(scene, [&](Material& m) {
        scene::for_each_input(m, [&](Input& input) {
            if (input.source == source) input = Input(input.value);
        });
    });
}

void find_varying(EffectFindings& found) {
    find_materials(
        found,
        [&](const Material& m) {
            return reads(found.scene, m, Input::Source::Primvar, is_primvar);
        },
        [](const Material&) { return "an input by a primvar"; });
    const scene::Scene& s = found.scene;
    const scene::PrimvarId color = scene::find_primvar(s, scene::display_color_primvar);
    scene::for_each_shape(s, [&](const scene::Shape& shape) {
        if (scene::shows_display_color(shape) && scene::find_primvar(shape, color))
            found.on(found.prim_of(shape.provenance), "its displayColor");
    });
    for (const scene::Instance& i : s.instances)
        if (color != scene::none && scene::find_value(s, i, color))
            found.on(found.prim_of(i.provenance), "its displayColor");
}

void find_textures(EffectFindings& found) {
    find_materials(
        found,
        [&](const Material& m) {
            return reads(found.scene, m, Input::Source::Texture, is_texture);
        },
        [](const Material&) { return "an input by a texture"; });
}

void forget_textures(scene::Scene& scene) {
    forget_inputs(scene, Input::Source::Texture);
    forget_steps(scene, is_texture);
    scene.textures.clear();
}

void find_patterns(EffectFindings& found) {
    find_materials(
        found,
        [&](const Material& m) { return reads(found.scene, m, Input::Source::Pattern, nullptr); },
        [](const Material&) { return "an input by a node graph"; });
}

bool turns_normals(const Material& m) {
    return !is_constant(m.normal) || m.normal.value != Rgb(0.0f, 0.0f, 1.0f);
}

void find_normal_maps(EffectFindings& found) {
    find_materials(found, turns_normals, [](const Material& m) {
        return is_constant(m.normal) ? std::string("normal that is not (0, 0, 1)")
                                     : named_value("normal", m.normal);
    });
}

void find_cutouts(EffectFindings& found) {
    const auto is_whole = [](const Material& m) {
        return (m.presence || m.opacity_threshold > 0.0f) && !scene::can_cut(m);
    };
    find_materials(found, scene::can_cut, [](const Material& m) {
        return named_value("opacity", m.opacity) +
               (m.presence ? ", opacityMode presence"
                           : fmt::format(", opacityThreshold {:g}", m.opacity_threshold));
    });
    for (const Material& m : found.scene.materials)
        if (is_whole(m)) found.zero(m.name, named_value("opacity", m.opacity) + " everywhere");
    if (scene::can_cut_display(found.scene)) found.on("", "displayOpacity below 1");
}

void fill_cutouts(scene::Scene& scene) {
    change_materials(scene, [](Material& m) {
        if (!scene::can_cut(m)) return;
        m.presence = false;
        m.opacity_threshold = 0;
        m.opacity = Input(1.0f);
    });
    const scene::PrimvarId name = scene::find_primvar(scene, scene::display_opacity_primvar);
    const auto fill = [&](scene::Shape& shape) {
        std::visit(
            [&](auto& g) {
                std::erase_if(g.primvars, [&](const scene::Primvar& p) { return p.name == name; });
            },
            shape.geometry);
    };
    for (scene::Shape& shape : scene.shapes) fill(shape);
    for (scene::Prototype& prototype : scene.prototypes)
        for (scene::Shape& shape : prototype.shapes) fill(shape);
    for (scene::InstanceValue& value : scene.instance_values)
        if (value.name == name) value.values[0] = 1.0f;
}

void find_transmission(EffectFindings& found) {
    find_materials(
        found, [](const Material& m) { return scene::can_transmit(m) && !m.is_bare; },
        [](const Material& m) { return named_value("opacity", m.opacity); });
}

void make_opaque(scene::Scene& scene) {
    change_materials(scene, [](Material& m) {
        if (scene::can_transmit(m) && !m.is_bare) m.opacity = Input(1.0f);
    });
}

void find_rough_transmission(EffectFindings& found) {
    for (const Material& m : found.scene.materials) {
        if (!m.rough_transmission) continue;
        if (scene::can_transmit(m) && is_positive(m.roughness))
            found.on(m.name, named_value("roughness", m.roughness));
        else
            found.zero(m.name, scene::can_transmit(m) ? "roughness 0" : "transmits no light");
    }
}

void find_thin_walls(EffectFindings& found) {
    find_materials(
        found, [](const Material& m) { return m.thin_walled; },
        [](const Material& m) {
            return m.is_open_sheet ? "mesh with boundary edges" : "thinWalled";
        });
}

void thicken_walls(scene::Scene& scene) {
    change_materials(scene, [](Material& m) {
        // A wall has no depth: as a solid it does not begin to have one
        if (m.thin_walled) m.transmission_depth = 0;
        m.thin_walled = m.is_open_sheet = false;
    });
}

void find_diffuse_transmission(EffectFindings& found) {
    find_materials(found, scene::can_transmit_diffusely, [](const Material& m) {
        return named_value("diffuseTransmission", m.diffuse_transmission);
    });
    for (const Material& m : found.scene.materials)
        if (!m.thin_walled && is_positive(m.diffuse_transmission))
            found.zero(m.name, "is not a thin wall");
}

void find_absorption(EffectFindings& found) {
    for (const Material& m : found.scene.materials) {
        if (scene::can_absorb(m))
            found.on(m.name, m.interior
                                 ? "volume shader that absorbs"
                                 : fmt::format("transmissionDepth {:g}", m.transmission_depth));
        else if (m.transmission_depth > 0.0f)
            found.zero(m.name, scene::can_transmit(m) ? "transmissionColor white or a thin wall"
                                                      : "transmits no light");
    }
}

void forget_absorption(scene::Scene& scene) {
    change_materials(scene, [](Material& m) {
        if (!m.interior && !scene::scatters_inside(m)) {
            m.transmission_depth = 0;
            return;
        }
        m.interior = scene::medium_properties_inside(m);
        m.interior->absorption = Rgb(0.0f);
    });
}

void find_interior_media(EffectFindings& found) {
    for (const Material& m : found.scene.materials) {
        const bool is_asked =
            m.interior ? !is_black(m.interior->scattering) : !is_black(m.transmission_scatter);
        if (scene::scatters_inside(m))
            found.on(m.name, m.interior ? "volume shader that scatters"
                                        : fmt::format("transmissionScatter within {:g}",
                                                      m.transmission_depth));
        else if (is_asked)
            found.zero(m.name, m.thin_walled            ? "is a thin wall"
                               : scene::can_transmit(m) ? "transmissionDepth 0"
                                                        : "transmits no light");
    }
}

void clear_interiors(scene::Scene& scene) {
    change_materials(scene, [](Material& m) {
        m.transmission_scatter = Rgb(0.0f);
        if (m.interior) m.interior->scattering = Rgb(0.0f);
    });
}

void find_nested_bodies(EffectFindings& found) {
    for (const Material& m : found.scene.materials) {
        if (m.dielectric_priority == 0) continue;
        if (scene::has_priority(m))
            found.on(m.name, fmt::format("dielectricPriority {}", m.dielectric_priority));
        else
            found.zero(m.name, m.thin_walled ? "is a thin wall" : "transmits no light");
    }
}

void find_clearcoat(EffectFindings& found) {
    find_materials(
        found, [](const Material& m) { return is_positive(m.clearcoat); },
        [](const Material& m) { return named_value("clearcoat", m.clearcoat); });
}

void find_anisotropy(EffectFindings& found) {
    find_materials(
        found, [](const Material& m) { return is_positive(m.anisotropy); },
        [](const Material& m) { return named_value("anisotropy", m.anisotropy); });
}

void find_rough_diffuse(EffectFindings& found) {
    find_materials(found, scene::can_have_rough_base, [](const Material& m) {
        return named_value("diffuse roughness", m.extras->diffuse_roughness);
    });
}

void find_sheen(EffectFindings& found) {
    find_materials(found, scene::can_have_sheen,
                   [](const Material& m) { return named_value("sheen", m.extras->sheen); });
}

void find_thin_film(EffectFindings& found) {
    find_materials(found, scene::can_have_film, [](const Material& m) {
        return named_value("thin film of thickness", m.extras->film->thickness);
    });
}

void find_dispersion(EffectFindings& found) {
    find_materials(found, scene::is_dispersive, [](const Material& m) {
        return fmt::format("Abbe number {:g}", 1.0f / m.dispersion);
    });
}

void find_subsurface(EffectFindings& found) {
    find_materials(found, scene::can_scatter_below,
                   [](const Material& m) { return named_value("subsurface", m.subsurface); });
    for (const Material& m : found.scene.materials)
        if (m.thin_walled && is_positive(m.subsurface)) found.zero(m.name, "is a thin wall");
}

/// Materials of hair that curves may have.
void find_hair(EffectFindings& found) {
    std::vector<bool> is_used(found.scene.materials.size());
    const auto use = [&](scene::MaterialId m) {
        if (m < is_used.size()) is_used[m] = true;
    };
    scene::for_each_shape(found.scene, [&](const scene::Shape& shape) {
        if (std::holds_alternative<scene::Curves>(shape.geometry)) use(shape.material);
    });
    for (const scene::Instance& i : found.scene.instances) use(i.material_override);
    for (size_t m = 0; m < is_used.size(); ++m) {
        const Material& material = found.scene.materials[m];
        if (!material.hair) continue;
        if (is_used[m])
            found.on(material.name, "scatters in hair curves");
        else
            found.zero(material.name, "is on no curve");
    }
}

void forget_hair(scene::Scene& scene) {
    change_materials(scene, [](Material& m) { m.hair.reset(); });
}

constexpr std::array rules = {
    EffectRule{Effect::VaryingColors, find_varying, nullptr},
    EffectRule{Effect::Textures, find_textures, forget_textures},
    EffectRule{Effect::NormalMaps, find_normal_maps,
               [](scene::Scene& s) {
                   change_materials(s,
                                    [](Material& m) { m.normal = Input(Rgb(0.0f, 0.0f, 1.0f)); });
               }},
    EffectRule{Effect::Cutouts, find_cutouts, fill_cutouts, true},
    EffectRule{Effect::Transmission, find_transmission, make_opaque},
    EffectRule{Effect::RoughTransmission, find_rough_transmission,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.rough_transmission = false; });
               }},
    EffectRule{Effect::ThinWalls, find_thin_walls, thicken_walls, true},
    EffectRule{Effect::DiffuseTransmission, find_diffuse_transmission,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.diffuse_transmission = Input(0.0f); });
               }},
    EffectRule{Effect::Absorption, find_absorption, forget_absorption, true},
    EffectRule{Effect::InteriorMedia, find_interior_media, clear_interiors, true},
    EffectRule{Effect::NestedDielectrics, find_nested_bodies,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.dielectric_priority = 0; });
               }},
    EffectRule{Effect::Clearcoat, find_clearcoat,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.clearcoat = Input(0.0f); });
               }},
    EffectRule{Effect::ThinFilm, find_thin_film,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) {
                       if (m.extras && m.extras->film) m.extras->film->weight = Input(0.0f);
                   });
               }},
    EffectRule{
        Effect::Dispersion, find_dispersion,
        [](scene::Scene& s) { change_materials(s, [](Material& m) { m.dispersion = 0.0f; }); }},
    EffectRule{Effect::RoughDiffuse, find_rough_diffuse,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) {
                       if (m.extras) m.extras->diffuse_roughness = Input(0.0f);
                   });
               }},
    EffectRule{Effect::Sheen, find_sheen,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) {
                       if (m.extras) m.extras->sheen = Input(0.0f);
                   });
               }},
    EffectRule{Effect::Patterns, find_patterns,
               [](scene::Scene& s) { forget_inputs(s, Input::Source::Pattern); }},
    EffectRule{Effect::Subsurface, find_subsurface,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.subsurface = Input(0.0f); });
               }},
    EffectRule{Effect::Hair, find_hair, forget_hair},
    EffectRule{Effect::Anisotropy, find_anisotropy,
               [](scene::Scene& s) {
                   change_materials(s, [](Material& m) { m.anisotropy = Input(0.0f); });
               }},
};

}  // namespace

std::span<const EffectRule> surface_rules() {
    return rules;
}

}  // namespace velatura::integrator
