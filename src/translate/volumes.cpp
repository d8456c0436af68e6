// SPDX-License-Identifier: Apache-2.0
#include "translate/volumes.h"

#include "translate/values.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <string_view>

namespace velatura::translate {

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
                fmt::format("{} leads to <{}>, which is not there", name, targets[0].to_string()));
        } else if (field.type_name() != "OpenVDBAsset") {
            ctx.warn("volume-field", field,
                     fmt::format("{} leads to a {}, expected an OpenVDBAsset; it is left out", name,
                                 field.type_name().str()));
        } else {
            out.emplace(name.substr(field_prefix.size()), field);
        }
    }
    return out;
}

std::optional<FieldRole> usual_role(std::string_view name) {
    for (const char* density : {"density", "smoke", "fog"})
        if (name == density) return FieldRole::Density;
    for (const char* emission : {"heat", "flame", "flames", "fire", "emission"})
        if (name == emission) return FieldRole::Emission;
    if (name == "temperature") return FieldRole::Temperature;
    for (const char* color : {"color", "albedo", "Cd"})
        if (name == color) return FieldRole::Color;
    return std::nullopt;
}

/// Index of the field among those of the scene.
uint32_t field_index(Context& ctx, Prim prim, FieldRole role) {
    scene::VolumeField field;
    const Attribute file = prim.attribute("filePath");
    field.authored = read_text(file, "", ctx.time);
    field.file = file.resolved_asset_path(ctx.time);
    field.grid = read_text(prim.attribute("fieldName"), "", ctx.time);
    field.index = read_int(prim.attribute("fieldIndex"), 0, ctx.time);
    if (usd::stage::local_transform(prim, ctx.time).matrix != Mat4d())
        ctx.warn("volume-field", prim,
                 "a transform of a field is not used: fields stand where their volume does");
    const std::string key =
        fmt::format("{}|{}|{}|{}", field.file, field.grid, field.index, role == FieldRole::Color);
    const auto [at, is_new] =
        ctx.volume_fields.try_emplace(key, uint32_t(ctx.scene.volume_fields.size()));
    if (is_new) {
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

}  // namespace

std::optional<scene::Volume> read_volume(Context& ctx, Prim prim, const Mat4d& matrix) {
    if (determinant3(matrix) == 0.0) {
        ctx.warn("bad-transform", prim, "transform flattens the volume, it is left out");
        return std::nullopt;
    }
    scene::Volume volume;
    volume.name = prim.path_string();
    volume.render_from_volume = matrix;
    volume.extent = read_extent(ctx, prim);
    volume.provenance = ctx.provenance(prim);
    std::map<std::string, FieldRole> roles;
    volume.optics = read_volume_optics(ctx, prim, roles);

    const std::map<std::string, Prim> fields = field_prims(ctx, prim);
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
            ctx.warn(
                "volume-field", prim,
                fmt::format("field:{} is not used: another field is there for the same", name));
            continue;
        }
        index = field_index(ctx, field, *role);
    }
    if (volume.density == scene::none && volume.emission == scene::none) {
        ctx.warn("volume-field", prim,
                 "a volume without a density and without heat is nothing, it is left out");
        return std::nullopt;
    }
    if (volume.temperature == scene::none) volume.optics.blackbody = 0.0f;
    return volume;
}

}  // namespace velatura::translate
