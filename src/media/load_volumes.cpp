// SPDX-License-Identifier: Apache-2.0
#include "media/load_volumes.h"

#include "scene/affine_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>

namespace velatura::media {

namespace {

using scene::Scene;
using scene::Volume;

bool is_something(const Scene& scene, const Volume& volume) {
    return scene::is_level_set(volume, scene.volume_fields) ||
           scene::has_extinction(volume, scene.volume_fields) ||
           scene::has_emission(volume, scene.volume_fields);
}

std::array<uint32_t, 4> fields_of(const Volume& volume) {
    return {volume.density, volume.emission, volume.temperature, volume.color};
}

const scene::Provenance& provenance(const Scene& scene, scene::ProvenanceId id) {
    static const scene::Provenance nowhere;
    return id < scene.provenance.size() ? scene.provenance[id] : nowhere;
}

/// Notes that the volume is not rendered.
void note_lost(Scene& scene, const Volume& volume, std::string_view why) {
    scene::note_effect(scene.effect_notes, scene::Effect::Volumes,
                       scene::EffectNote::Kind::NotSimulated, volume.name, why);
}

class Loader {
  public:
    Loader(Scene& scene, const VolumeSource& source, size_t max_bytes, Diagnostics& diagnostics)
        : scene_(scene), source_(source), left_(max_bytes), diagnostics_(diagnostics) {
        for (const scene::VolumeField& field : scene.volume_fields)
            if (field.voxels) take(field.voxels->bytes());
        is_tried_.resize(scene.volume_fields.size(), false);
    }

    /// Whether all grids of the volume are there.
    bool load(const Volume& volume) {
        bool is_whole = true;
        for (const uint32_t field : fields_of(volume))
            if (field != scene::none) is_whole = read(field, field == volume.color) && is_whole;
        return is_whole;
    }

  private:
    bool read(uint32_t index, bool is_color) {
        scene::VolumeField& field = scene_.volume_fields[index];
        if (field.voxels || is_tried_[index]) return field.voxels != nullptr;
        is_tried_[index] = true;
        const GridRequest request{field.file, field.grid, field.index, is_color, field.kind, left_};
        Result<scene::VoxelGrid> grid = source_.read(request);
        if (!grid) {
            const scene::Provenance& where = provenance(scene_, field.provenance);
            diagnostics_.error(grid.error().code, where.loc, where.prim_path,
                               fmt::format("@{}@: {}; the volume is skipped", field.authored,
                                           grid.error().message));
            return false;
        }
        take(grid->bytes());
        if (is_color && grid->channels == 3 && !field.colors.is_identity())
            decode(field.colors, grid->values);
        field.voxels = std::make_shared<const scene::VoxelGrid>(std::move(*grid));
        return true;
    }

    static void decode(const scene::ColorDecoding& colors, std::vector<float>& values) {
        for (size_t i = 0; i + 2 < values.size(); i += 3) {
            const Vec3d color =
                colors(Vec3d(double(values[i]), double(values[i + 1]), double(values[i + 2])));
            for (size_t c = 0; c < 3; ++c) values[i + c] = float(color[int(c)]);
        }
    }

    void take(size_t bytes) { left_ -= std::min(left_, bytes); }

    Scene& scene_;
    const VolumeSource& source_;
    size_t left_;
    Diagnostics& diagnostics_;
    std::vector<bool> is_tried_;
};

/// Puts the surface of a level set into the scene.
void add_surface(Scene& scene, const Volume& volume, Diagnostics& diagnostics) {
    const auto& grid = scene.volume_fields[volume.density].voxels;
    for (const uint32_t other : {volume.emission, volume.temperature, volume.color}) {
        if (other == scene::none) continue;
        const scene::Provenance& where = provenance(scene, volume.provenance);
        diagnostics.warn(
            "volume-field", where.loc, where.prim_path,
            fmt::format("grid {} is a level set; the other fields of the volume are not used",
                        scene.volume_fields[volume.density].grid));
        break;
    }
    const Mat4d map = grid->volume_from_lattice * volume.render_from_volume;
    if (!(std::abs(determinant3(map)) > 0.0)) {
        const scene::Provenance& where = provenance(scene, volume.provenance);
        diagnostics.warn("bad-transform", where.loc, where.prim_path,
                         "transform of the grid flattens the level set; it is skipped");
        return;
    }
    scene::Shape shape = volume.surface;
    shape.geometry = scene::LevelSet{grid, map, volume.surface_primvars};
    shape.link = volume.link;
    shape.provenance = volume.provenance;
    if (volume.later_render_from_volume.empty()) {
        scene.shapes.push_back(std::move(shape));
        return;
    }
    // One that moves is an instance of itself, in render space as when the shutter opens
    const scene::AffineMotion motion(volume.render_from_volume, volume.later_render_from_volume);
    scene::Instance instance;
    instance.prototype = uint32_t(scene.prototypes.size());
    for (size_t key = 1; key < motion.keys().size(); ++key)
        instance.later_render_from_prototype.push_back(Mat4(motion.keys()[key]));
    instance.provenance = volume.provenance;
    if (volume.link != 0) {
        instance.link_row = uint32_t(scene.linking.rows.size());
        scene.linking.rows.push_back({volume.link});
    }
    scene.prototypes.push_back({volume.name, {std::move(shape)}});
    scene.instances.push_back(std::move(instance));
}

}  // namespace

bool needs_grids(const Scene& scene) {
    return std::any_of(scene.volumes.begin(), scene.volumes.end(), [&](const Volume& v) {
        const auto fields = fields_of(v);
        return is_something(scene, v) && std::any_of(fields.begin(), fields.end(), [&](uint32_t f) {
                   return f != scene::none && !scene.volume_fields[f].voxels;
               });
    });
}

void load_volumes(Scene& scene,
                  const VolumeSource& source,
                  size_t max_bytes,
                  Diagnostics& diagnostics) {
    Loader loader(scene, source, max_bytes, diagnostics);
    std::erase_if(scene.volumes, [&](const Volume& v) {
        if (!is_something(scene, v)) return false;
        if (!loader.load(v)) {
            note_lost(scene, v, "a grid cannot be read");
            return true;
        }
        if (!scene::is_level_set(v, scene.volume_fields)) return false;
        add_surface(scene, v, diagnostics);
        return true;
    });
}

void drop_volumes(Scene& scene, const Error& why, Diagnostics& diagnostics) {
    bool is_first = true;
    std::erase_if(scene.volumes, [&](const Volume& v) {
        if (!is_something(scene, v)) return false;
        if (std::exchange(is_first, false)) {
            const scene::Provenance& where = provenance(scene, v.provenance);
            diagnostics.error(
                why.code, where.loc, where.prim_path,
                fmt::format("{}: volumes are skipped (the first is named here)", why.message));
        }
        note_lost(scene, v, "no plugin reads its grids");
        return true;
    });
}

}  // namespace velatura::media
