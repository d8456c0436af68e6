// SPDX-License-Identifier: Apache-2.0
#include "translate/volumes/volumes.h"

#include "translate/context/values.h"
#include "translate/geometry/primvars.h"
#include "translate/geometry/strands.h"
#include "translate/materials/interior.h"
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"
#include "usd/stage/material_binding.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace velatura::translate::volumes {

namespace {

constexpr std::string_view field_prefix = "field:";

/// The field prims of a volume, by what comes after `field:`.
std::map<std::string, Prim> field_prims(Context& ctx, Prim volume) {
    std::map<std::string, Prim> out;
    for (const auto& property : volume.property_names()) {
        const std::string& name = property.str();
        if (name.rfind(field_prefix, 0) != 0) continue;
        const auto targets = volume.relationship(name).forwarded_targets();
        if (targets.empty()) continue;
        const Prim field = ctx.stage.prim_at(targets[0].prim_path());
        if (!field) {
            ctx.warn(
                "volume-field", volume,
                fmt::format("{} targets <{}>, which does not exist", name, targets[0].to_string()));
        } else if (field.type_name() != "OpenVDBAsset") {
            ctx.warn("volume-field", field,
                     fmt::format("{} targets a {}, expected an OpenVDBAsset; it is ignored", name,
                                 field.type_name().str()));
        } else {
            out.emplace(name.substr(field_prefix.size()), field);
        }
    }
    return out;
}

std::optional<FieldRole> usual_role(std::string_view name) {
    for (const char* density : {"density", "smoke", "fog", "surface", "sdf"})
        if (name == density) return FieldRole::Density;
    for (const char* emission : {"heat", "flame", "flames", "fire", "emission"})
        if (name == emission) return FieldRole::Emission;
    if (name == "temperature") return FieldRole::Temperature;
    for (const char* color : {"color", "albedo", "Cd"})
        if (name == color) return FieldRole::Color;
    return std::nullopt;
}

/// What the field prim says that its numbers are.
scene::GridKind kind_of(Context& ctx, Prim field) {
    const std::string name = read_text(field.attribute("fieldClass"), "", ctx.time);
    return name == "levelSet"    ? scene::GridKind::LevelSet
           : name == "fogVolume" ? scene::GridKind::Densities
                                 : scene::GridKind::AsStored;
}

/// State of this module: Scene::volume_fields, by what is wanted of which file.
struct KnownFields {
    std::unordered_map<std::string, uint32_t> by_key;
};

/// Index of the field among those of the scene.
uint32_t field_index(Context& ctx, Prim prim, FieldRole role) {
    scene::VolumeField field;
    field.kind = role == FieldRole::Density ? kind_of(ctx, prim) : scene::GridKind::Densities;
    const Attribute file = prim.attribute("filePath");
    field.authored = read_text(file, "", ctx.time);
    field.file = file.resolved_asset_path(ctx.time);
    field.grid = read_text(prim.attribute("fieldName"), "", ctx.time);
    field.index = read_int(prim.attribute("fieldIndex"), 0, ctx.time);
    if (usd::stage::local_transform(prim, ctx.time).matrix != Mat4d())
        ctx.warn("volume-field", prim,
                 "transforms of fields are ignored; fields have the transform of their volume");
    const std::string key = fmt::format("{}|{}|{}|{}|{}", field.file, field.grid, field.index,
                                        role == FieldRole::Color, int(field.kind));
    const auto [at, is_new] =
        ctx.state<KnownFields>().by_key.try_emplace(key, uint32_t(ctx.scene.volume_fields.size()));
    if (is_new) {
        if (role == FieldRole::Color)
            field.colors =
                color::unmarked_texels(ctx, scene::SourceColorSpace::Raw, color::Meaning::Color)
                    .decoding;
        field.provenance = ctx.provenance(prim);
        ctx.scene.volume_fields.push_back(std::move(field));
    }
    return at->second;
}

uint32_t& slot(scene::Volume& volume, FieldRole role) {
    switch (role) {
        case FieldRole::Emission:
            return volume.emission;
        case FieldRole::Temperature:
            return volume.temperature;
        case FieldRole::Color:
            return volume.color;
        case FieldRole::Density:
            break;
    }
    return volume.density;
}

Box3d read_extent(Context& ctx, Prim prim) {
    Box3d box;
    std::vector<double> rows;
    int width = 0;
    if (!read_rows(prim.attribute("extent").value(ctx.time), rows, width) || width != 3 ||
        rows.size() != 6)
        return box;
    const Box3d read(Vec3d(rows[0], rows[1], rows[2]), Vec3d(rows[3], rows[4], rows[5]));
    return is_finite(read.min) && is_finite(read.max) ? read : box;
}

/// Whether the material has a surface and nothing that fills a volume.
bool is_surface_material(Context& ctx, Prim volume) {
    const auto binding =
        usd::stage::resolve_material(volume, ctx.state<materials::TranslatedMaterials>().purposes);
    return binding.material && materials::has_surface_output(binding.material) &&
           !materials::has_volume_output(binding.material);
}

/// The shape that the volume is where its density is a level set. kind: of that, as far as prims
/// tell.
void read_surface(Context& ctx, Prim prim, scene::GridKind kind, scene::Volume& volume) {
    if (kind == scene::GridKind::Densities) return;
    const bool is_certain = kind == scene::GridKind::LevelSet;
    static const materials::MaterialEntry no_material;
    const bool has_material = is_certain || is_surface_material(ctx, prim);
    const materials::MaterialEntry& material =
        has_material ? materials::bound_material(ctx, prim) : no_material;
    materials::warn_if_displaced(ctx, prim, material);
    volume.surface = geometry::round_shape(ctx, prim, material);
    const geometry::ElementCounts counts{1, 1, 1};
    for (scene::Primvar& primvar : geometry::read_primvars(ctx, prim, counts, {&material})) {
        primvar.interpolation = scene::Interpolation::Constant;
        volume.surface_primvars.push_back(std::move(primvar));
    }
    geometry::add_object_space(ctx, {&material}, volume.render_from_volume,
                               volume.surface_primvars);
}

using Fields = std::map<std::string, Prim>;

/// A field that is said to be a level set, which makes the volume a surface and all others useless.
Fields::const_iterator find_level_set(Context& ctx, const Fields& fields) {
    return std::find_if(fields.begin(), fields.end(), [&](const auto& field) {
        return kind_of(ctx, field.second) == scene::GridKind::LevelSet;
    });
}

/// Notes which grids the volume is made of.
void read_fields(Context& ctx,
                 Prim prim,
                 const Fields& fields,
                 const std::map<std::string, FieldRole>& roles,
                 scene::Volume& volume) {
    for (const auto& [name, field] : fields) {
        std::optional<FieldRole> role = usual_role(name);
        if (const auto at = roles.find(name); at != roles.end()) role = at->second;
        // Whatever the only field is called
        if (!role && fields.size() == 1) role = FieldRole::Density;
        if (!role) {
            ctx.warn("volume-field", prim,
                     fmt::format("field:{} is not used: fields are density, temperature, heat "
                                 "(flame, fire, emission) and color (albedo)",
                                 name));
            continue;
        }
        uint32_t& index = slot(volume, *role);
        if (index != scene::none) {
            ctx.warn("volume-field", prim,
                     fmt::format("field:{} is not used: another field has the same role", name));
            continue;
        }
        index = field_index(ctx, field, *role);
    }
}

}  // namespace

std::optional<scene::Volume> read_volume(Context& ctx, Prim prim, const Mat4d& matrix) {
    if (determinant3(matrix) == 0.0) {
        ctx.warn("bad-transform", prim, "transform flattens the volume; it is skipped");
        return std::nullopt;
    }
    scene::Volume volume;
    volume.name = prim.path_string();
    volume.render_from_volume = matrix;
    volume.extent = read_extent(ctx, prim);
    volume.provenance = ctx.provenance(prim);
    const Fields fields = field_prims(ctx, prim);
    const auto level_set = find_level_set(ctx, fields);
    if (level_set != fields.end()) {
        if (fields.size() > 1)
            ctx.warn(
                "volume-field", prim,
                fmt::format("field:{} is a level set; the other fields of the volume are not used",
                            level_set->first));
        volume.density = field_index(ctx, level_set->second, FieldRole::Density);
        volume.optics.blackbody = 0.0f;
        read_surface(ctx, prim, scene::GridKind::LevelSet, volume);
        return volume;
    }
    std::map<std::string, FieldRole> roles;
    volume.optics = read_volume_optics(ctx, prim, roles);
    read_fields(ctx, prim, fields, roles, volume);
    if (volume.density == scene::none && volume.emission == scene::none) {
        ctx.warn("volume-field", prim, "the volume has neither density nor heat; it is skipped");
        return std::nullopt;
    }
    if (volume.temperature == scene::none) volume.optics.blackbody = 0.0f;
    if (volume.density != scene::none)
        read_surface(ctx, prim, ctx.scene.volume_fields[volume.density].kind, volume);
    return volume;
}

}  // namespace velatura::translate::volumes
