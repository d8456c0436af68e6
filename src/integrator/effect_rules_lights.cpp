// SPDX-License-Identifier: Apache-2.0
#include "integrator/effect_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace velatura::integrator {

using scene::Effect;
using scene::Light;
using scene::LightKind;

namespace {

/// Finds the lights that `is_used` holds of; those that emit nothing prove zero.
template <class Test>
void find_lights(EffectFindings& found, Test is_used, std::string_view why) {
    for (const Light& l : found.scene.lights) {
        if (!is_used(l)) continue;
        if (is_black(l.Le))
            found.zero(l.name, "emits nothing: intensity or color 0");
        else
            found.on(l.name, why);
    }
}

void find_surface_emission(EffectFindings& found) {
    for (const scene::Material& m : found.scene.materials)
        if (scene::is_emissive(m))
            found.on(m.name, scene::is_constant(m.emissive_color) ? "emissiveColor"
                                                                  : "emissiveColor that varies");
}

void find_mesh_lights(EffectFindings& found) {
    for (const scene::MeshLight& l : found.scene.mesh_lights) {
        // Without radiance of its own it still shows its material
        if (is_black(l.Le) && !l.shows_material)
            found.zero(l.name, "emits nothing: intensity or color 0");
        else
            found.on(l.name, "geometry with LightAPI");
    }
}

void forget_mesh_lights(scene::Scene& scene) {
    const auto forget = [](scene::Shape& shape) { shape.light = scene::none; };
    for (scene::Shape& shape : scene.shapes) forget(shape);
    for (scene::Prototype& prototype : scene.prototypes)
        for (scene::Shape& shape : prototype.shapes) forget(shape);
    scene.mesh_lights.clear();
}

bool is_dome(const Light& l) {
    return l.kind == LightKind::Dome;
}

void find_domes(EffectFindings& found) {
    find_lights(found, is_dome, "light from everywhere");
}

void find_dome_maps(EffectFindings& found) {
    find_lights(
        found, [](const Light& l) { return is_dome(l) && !l.texture_file.empty(); },
        "its texture is importance-sampled");
}

void find_portals(EffectFindings& found) {
    find_lights(
        found, [](const Light& l) { return !l.render_from_portals.empty(); },
        "sampled through its portals");
}

void find_light_textures(EffectFindings& found) {
    find_lights(
        found, [](const Light& l) { return l.kind == LightKind::Rect && !l.texture_file.empty(); },
        "rect light with a texture");
}

template <class Change>
void change_lights(scene::Scene& scene, Change change) {
    for (Light& l : scene.lights) change(l);
}

void find_shaping(EffectFindings& found) {
    find_lights(
        found, [](const Light& l) { return l.shaping.is_active; }, "cone or focus");
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (l.shaping.is_active) found.on(l.name, "cone or focus");
}

/// Cone and focus; profiles stay.
void forget_shaping(scene::Scene& scene) {
    const auto forget = [](scene::Shaping& shaping) {
        scene::Shaping kept;
        kept.ies = shaping.ies;
        kept.ies_angle_scale = shaping.ies_angle_scale;
        kept.ies_normalize = shaping.ies_normalize;
        shaping = std::move(kept);
    };
    change_lights(scene, [&](Light& l) { forget(l.shaping); });
    for (scene::MeshLight& l : scene.mesh_lights) forget(l.shaping);
}

void find_profiles(EffectFindings& found) {
    find_lights(
        found, [](const Light& l) { return l.shaping.ies != nullptr; }, "IES profile");
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (l.shaping.ies) found.on(l.name, "IES profile");
}

void forget_profiles(scene::Scene& scene) {
    change_lights(scene, [](Light& l) { l.shaping.ies = nullptr; });
    for (scene::MeshLight& l : scene.mesh_lights) l.shaping.ies = nullptr;
}

template <class AnyLight>
bool has_multiplier(const AnyLight& l) {
    return l.diffuse_multiplier != 1.0f || l.specular_multiplier != 1.0f;
}

void find_multipliers(EffectFindings& found) {
    const std::string_view why = "inputs:diffuse or inputs:specular is not 1";
    find_lights(found, has_multiplier<Light>, why);
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (has_multiplier(l)) found.on(l.name, why);
}

void forget_multipliers(scene::Scene& scene) {
    change_lights(scene, [](Light& l) { l.diffuse_multiplier = l.specular_multiplier = 1.0f; });
    for (scene::MeshLight& l : scene.mesh_lights)
        l.diffuse_multiplier = l.specular_multiplier = 1.0f;
}

/// A choice is to be made where more than one light shines; emissive surfaces count for as many as
/// they may have triangles.
void find_choices(EffectFindings& found) {
    const scene::Scene& s = found.scene;
    const auto shines = [](const Light& l) { return !is_black(l.Le); };
    const auto lights = size_t(std::count_if(s.lights.begin(), s.lights.end(), shines));
    const bool has_surfaces =
        !s.mesh_lights.empty() ||
        std::any_of(s.materials.begin(), s.materials.end(), scene::is_emissive);
    if (lights > 1 || has_surfaces)
        found.on("", has_surfaces ? fmt::format("{} lights and emissive surfaces", lights)
                                  : fmt::format("{} lights", lights));
    else if (s.lights.size() > 1)
        found.zero("", "only one of the lights is on");
}

bool is_linked(const scene::Scene& scene, const scene::LightLinks& links) {
    return links.lit != scene::none || scene::has_shadow_links(scene, links);
}

void find_links(EffectFindings& found) {
    const std::string_view why = "has light or shadow links";
    find_lights(
        found, [&](const Light& l) { return is_linked(found.scene, l.links); }, why);
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (is_linked(found.scene, l.links)) found.on(l.name, why);
}

void find_shadow_controls(EffectFindings& found) {
    const std::string_view why = "shadows that are off, end at a distance or have a color";
    find_lights(
        found, [&](const Light& l) { return scene::has_shadow_controls(found.scene, l.links); },
        why);
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (scene::has_shadow_controls(found.scene, l.links)) found.on(l.name, why);
}

/// Of lights of both kinds.
template <class Change>
void change_links(scene::Scene& scene, Change change) {
    for (Light& l : scene.lights) change(l.links);
    for (scene::MeshLight& l : scene.mesh_lights) change(l.links);
}

void forget_links(scene::Scene& scene) {
    // What was a part of a light would shine on everything once more
    std::erase_if(scene.lights, [](const Light& l) { return l.is_filter_copy; });
    change_links(scene, [&](scene::LightLinks& links) {
        links.lit = scene::none;
        if (scene::has_shadow_links(scene, links))
            links.casters = scene::plain_links(scene).casters;
    });
}

void forget_shadow_controls(scene::Scene& scene) {
    change_links(scene, [&](scene::LightLinks& links) {
        const scene::LinkSetId casters = scene::has_shadow_links(scene, links)
                                             ? links.casters
                                             : scene::plain_links(scene).casters;
        links = {.lit = links.lit, .casters = casters};
    });
}

void find_filters(EffectFindings& found) {
    const std::string_view why = "light filter";
    find_lights(
        found, [](const Light& l) { return !l.filters.empty(); }, why);
    for (const scene::MeshLight& l : found.scene.mesh_lights)
        if (!l.filters.empty()) found.on(l.name, why);
}

void forget_filters(scene::Scene& scene) {
    change_lights(scene, [](Light& l) { l.filters.clear(); });
    for (scene::MeshLight& l : scene.mesh_lights) l.filters.clear();
}

/// Notes a prim of which the set holds nothing, or something.
void find_in_set(EffectFindings& found, scene::LinkSetId set, bool is_held, std::string_view why) {
    const scene::Scene& s = found.scene;
    const scene::LinkSet& classes = s.linking.sets[set];
    for (const scene::Shape& shape : s.shapes)
        if (classes.holds(shape.link) == is_held) found.on(found.prim_of(shape.provenance), why);
    for (const scene::Volume& volume : s.volumes)
        if (classes.holds(volume.link) == is_held) found.on(volume.name, why);
    for (uint32_t i = 0; i < s.instances.size(); ++i) {
        const size_t count = s.prototypes[s.instances[i].prototype].shapes.size();
        for (uint32_t shape = 0; shape < count; ++shape)
            if (classes.holds(scene::link_class(s, i, shape)) == is_held) {
                found.on(found.prim_of(s.instances[i].provenance), why);
                break;
            }
    }
}

void find_ray_visibility(EffectFindings& found) {
    for (const scene::LinkSetId set : found.scene.linking.visible)
        if (set != scene::none) find_in_set(found, set, false, "invisible to some kinds of rays");
}

void forget_ray_visibility(scene::Scene& scene) {
    change_links(scene, [&](scene::LightLinks& links) {
        if (links.casters == scene::plain_links(scene).casters) links.casters = scene::none;
    });
    scene.linking.visible.fill(scene::none);
}

void find_mattes(EffectFindings& found) {
    const scene::LinkSetId set = found.scene.linking.mattes;
    if (set != scene::none) find_in_set(found, set, true, "matte: held out of the image");
}

void find_catchers(EffectFindings& found) {
    const scene::LinkSetId set = found.scene.linking.catchers;
    if (set != scene::none) find_in_set(found, set, true, "catcher: its light is in layers alone");
}

constexpr std::array rules = {
    EffectRule{Effect::SurfaceEmission, find_surface_emission,
               [](scene::Scene& s) {
                   for (scene::Material& m : s.materials)
                       m.emissive_color = scene::Input(Rgb(0.0f));
               }},
    EffectRule{Effect::MeshLights, find_mesh_lights, forget_mesh_lights},
    EffectRule{Effect::Environment, find_domes,
               [](scene::Scene& s) { std::erase_if(s.lights, is_dome); }},
    EffectRule{Effect::EnvironmentMaps, find_dome_maps,
               [](scene::Scene& s) {
                   change_lights(s, [](Light& l) {
                       if (is_dome(l)) l.texture_file.clear();
                   });
               }},
    EffectRule{
        Effect::Portals, find_portals,
        [](scene::Scene& s) { change_lights(s, [](Light& l) { l.render_from_portals.clear(); }); }},
    EffectRule{Effect::LightTextures, find_light_textures,
               [](scene::Scene& s) {
                   change_lights(s, [](Light& l) {
                       if (!is_dome(l)) l.texture_file.clear();
                   });
               }},
    EffectRule{Effect::LightShaping, find_shaping, forget_shaping},
    EffectRule{Effect::LightProfiles, find_profiles, forget_profiles},
    EffectRule{Effect::LobeMultipliers, find_multipliers, forget_multipliers, true},
    EffectRule{Effect::LightSelection, find_choices, nullptr, true},
    EffectRule{Effect::LightLinking, find_links, forget_links, true},
    EffectRule{Effect::ShadowControls, find_shadow_controls, forget_shadow_controls},
    EffectRule{Effect::LightFilters, find_filters, forget_filters},
    EffectRule{Effect::RayVisibility, find_ray_visibility, forget_ray_visibility},
    EffectRule{Effect::Mattes, find_mattes,
               [](scene::Scene& s) { s.linking.mattes = scene::none; }},
    EffectRule{Effect::Catchers, find_catchers,
               [](scene::Scene& s) { s.linking.catchers = scene::none; }},
};

}  // namespace

std::span<const EffectRule> light_rules() {
    return rules;
}

}  // namespace velatura::integrator
