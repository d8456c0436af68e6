// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/mesh_lights.h"

#include "translate/context/values.h"
#include "translate/lights/light_filters.h"
#include "translate/lights/light_groups.h"
#include "translate/lights/light_inputs.h"
#include "translate/lights/lights.h"
#include "translate/materials/materials.h"
#include "usd/stage/material_binding.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::translate::lights {

namespace {

/// How a light follows the material of its geometry: UsdLuxLightAPI's materialSyncMode.
enum class MaterialSync { GlowTintsLight, Independent, NoResponse };

MaterialSync read_sync(Context& ctx, Prim prim) {
    const Attribute attribute = prim.attribute("light:materialSyncMode");
    const bool is_mesh_light = prim.has_api("MeshLightAPI");
    const char* fallback = is_mesh_light ? "materialGlowTintsLight" : "noMaterialResponse";
    const std::string mode =
        attribute.has_authored_value() ? read_text(attribute, fallback, ctx.time) : fallback;
    if (mode == "materialGlowTintsLight") return MaterialSync::GlowTintsLight;
    if (mode == "independent") return MaterialSync::Independent;
    if (mode != "noMaterialResponse")
        ctx.warn(
            "unsupported-light-input", attribute,
            fmt::format("light:materialSyncMode {} is unknown, noMaterialResponse is used", mode));
    return MaterialSync::NoResponse;
}

bool has_any_binding(Context& ctx, Prim prim) {
    if (materials::has_binding(ctx, prim)) return true;
    const auto subsets = usd::stage::material_subsets(prim);
    return std::any_of(subsets.begin(), subsets.end(),
                       [&](Prim subset) { return materials::has_binding(ctx, subset); });
}

/// Whether some face of the shape has a material that emits.
bool has_glow(const Context& ctx, const scene::Shape& shape) {
    const auto glows = [&](scene::MaterialId id) {
        if (id >= ctx.scene.materials.size()) return false;
        const scene::Input& emission = ctx.scene.materials[id].emissive_color;
        return emission.source != scene::Input::Source::Constant || !is_black(emission.value);
    };
    const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
    if (mesh == nullptr || mesh->face_materials.empty()) return glows(shape.material);
    return std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(), glows);
}

/// State of this module: the material of mesh lights without material response.
struct BlackMaterial {
    scene::MaterialId id = scene::none;
};

/// The material of what answers to no light.
scene::MaterialId black_material(Context& ctx) {
    scene::MaterialId& id = ctx.state<BlackMaterial>().id;
    if (id == scene::none) {
        scene::Material black;
        black.diffuse_color = scene::Input(Rgb(0.0f));
        black.has_specular = false;
        id = scene::MaterialId(ctx.scene.materials.size());
        ctx.scene.materials.push_back(std::move(black));
    }
    return id;
}

}  // namespace

bool is_geometry_light(Prim prim) {
    return prim.has_api("LightAPI") || prim.has_api("MeshLightAPI");
}

void make_mesh_light(Context& ctx, const LightSite& site, scene::Shape& shape) {
    const Prim prim = site.prim;
    ctx.state<CollectedLights>().has_prim = true;
    scene::MeshLight light;
    light.name = prim.path_string();
    const Vec3d Le = read_radiance(ctx, prim, 1.0);
    if (!is_good_radiance(ctx, prim, Le)) return;
    light.Le = to_float(Le);
    light.is_normalized = read_bool(light_input(ctx, prim, "normalize"), false, ctx.time);
    light.shaping = read_shaping(ctx, prim);
    light.parent_from_light = site.matrix;
    light.later_parent_from_light = site.later;
    light.diffuse_multiplier = float(input_number(ctx, prim, "diffuse", 1.0));
    light.specular_multiplier = float(input_number(ctx, prim, "specular", 1.0));
    light.filters = read_filters(ctx, {prim, site.matrix, light.shaping.cone_angle_deg});
    light.links = read_shadow(ctx, prim);
    warn_light_features(ctx, prim);

    // Geometry without a material has nothing to follow
    const MaterialSync sync =
        has_any_binding(ctx, prim) ? read_sync(ctx, prim) : MaterialSync::NoResponse;
    light.is_tinted_by_emission = sync == MaterialSync::GlowTintsLight;
    light.shows_material = sync != MaterialSync::NoResponse;
    if (light.is_tinted_by_emission && !has_glow(ctx, shape))
        ctx.warn("mesh-light-without-glow", prim,
                 "light tinted by the emission of its material, which emits nothing; the light "
                 "emits nothing (see light:materialSyncMode)");
    if (!light.shows_material) {
        shape.material = black_material(ctx);
        if (auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) mesh->face_materials.clear();
    }
    light.provenance = shape.provenance;
    shape.light = scene::MeshLightId(ctx.scene.mesh_lights.size());
    ctx.scene.mesh_lights.push_back(std::move(light));
    ctx.state<CollectedLights>().mesh_lights.push_back(prim);
}

void join_mesh_light_groups(Context& ctx, const std::vector<scene::Shape>& shapes) {
    for (const scene::Shape& shape : shapes) {
        if (shape.light == scene::none) continue;
        ctx.scene.mesh_lights[shape.light].group =
            join_light_group(ctx, ctx.state<CollectedLights>().mesh_lights[shape.light]);
    }
}

}  // namespace velatura::translate::lights
