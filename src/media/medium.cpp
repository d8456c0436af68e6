// SPDX-License-Identifier: Apache-2.0
#include "media/medium.h"

#include "media/voxel_lookup.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

namespace {

/// Rounding of the interpolation between numbers within the bounds of a brick.
constexpr float interpolation_margin = 1.0f + 0x1p-20f;

/// How often a ray meets a medium that gives light, per brick that it crosses straight.
constexpr double meetings_per_brick = 2.0;

Box3 placed_bounds(const VoxelGrid& grid, const Mat4d& render_from_lattice) {
    Box3 bounds;
    for (int i = 0; i < 8; ++i) {
        const Vec3d corner(i & 1 ? double(grid.box_max.x) : double(grid.box_min.x),
                           i & 2 ? double(grid.box_max.y) : double(grid.box_min.y),
                           i & 4 ? double(grid.box_max.z) : double(grid.box_min.z));
        bounds.extendBy(to_float(transform_point(corner, render_from_lattice)));
    }
    return bounds;
}

/// Color of a black body of luminance 1, by a table of steps of 100 K.
Rgb glow_color(const std::vector<Rgb>& colors, float kelvin) {
    if (colors.empty()) return Rgb(1.0f);
    const float x = std::clamp(kelvin / 100.0f, 0.0f, float(colors.size() - 1));
    const size_t i = std::min(size_t(x), colors.size() - 2);
    return colors[i] + (colors[i + 1] - colors[i]) * (x - float(i));
}

/// A medium below the Draper point, 798 K, does not glow to the eye: faded in over the last
/// 100 K.
float visible_share(float kelvin) {
    return std::clamp((kelvin - 700.0f) / 100.0f, 0.0f, 1.0f);
}

}  // namespace

Medium::Medium(const scene::Scene& scene,
               uint32_t volume,
               uint32_t field,
               const MediumOptions& options)
    : optics_(&scene.volumes[volume].optics),
      options_(options),
      phase_(optics_->anisotropy),
      volume_(volume),
      link_(scene.volumes[volume].link) {
    const scene::Volume& v = scene.volumes[volume];
    field_ = place(scene, v, field);
    color_ = place(scene, v, v.color);
    temperature_ = place(scene, v, v.temperature);
    const Mat4d render_from_lattice = field_.grid->volume_from_lattice * v.render_from_volume;
    bounds_ = placed_bounds(*field_.grid, render_from_lattice);
    const double cell = std::cbrt(std::abs(determinant3(render_from_lattice)));
    meeting_rate_ = float(meetings_per_brick / (cell * VoxelGrid::brick_cells));
    for (const VoxelGrid::Brick& brick : field_.grid->bricks)
        whole_.max = std::max(whole_.max, brick.max);
}

PlacedGrid Medium::place(const scene::Scene& scene,
                         const scene::Volume& volume,
                         uint32_t field) const {
    if (field == scene::none || !scene.volume_fields[field].voxels) return {};
    const VoxelGrid& grid = *scene.volume_fields[field].voxels;
    const Mat4d render_from_lattice = grid.volume_from_lattice * volume.render_from_volume;
    const Mat4d inverse = render_from_lattice.inverse();
    PlacedGrid placed{&grid, Mat4()};
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c) placed.lattice_from_render[r][c] = float(inverse[r][c]);
    return placed;
}

std::optional<Medium> Medium::extinction(const scene::Scene& scene,
                                         uint32_t volume,
                                         const MediumOptions& options) {
    const scene::Volume& v = scene.volumes[volume];
    if (v.density == scene::none || !scene.volume_fields[v.density].voxels) return std::nullopt;
    Medium medium(scene, volume, v.density, options);
    const Rgb& color = v.optics.extinction_color;
    const float max = max_component(color);
    medium.largest_sigma_ = v.optics.density_scale * max;
    if (max > 0.0f) medium.channels_ = color / max;
    medium.is_gray_ = color.x == color.y && color.y == color.z;
    return medium;
}

std::optional<Medium> Medium::emission(const scene::Scene& scene,
                                       uint32_t volume,
                                       const MediumOptions& options) {
    const scene::Volume& v = scene.volumes[volume];
    const uint32_t field = v.emission != scene::none ? v.emission : v.density;
    if (field == scene::none || !scene.volume_fields[field].voxels) return std::nullopt;
    if (!scene::has_emission(v, scene.volume_fields)) return std::nullopt;
    Medium medium(scene, volume, field, options);
    medium.gives_light_ = true;
    medium.is_thermal_ = v.emission == scene::none;
    return medium;
}

bool Medium::clip(const Vec3& o, const Vec3& d, float& begin, float& end) const {
    return clip_to_box(field_.grid->box_min, field_.grid->box_max,
                       transform_point(o, field_.lattice_from_render),
                       transform_direction(d, field_.lattice_from_render), begin, end);
}

BrickWalk Medium::walk(const Vec3& o, const Vec3& d, float begin, float end) const {
    if (has_one_majorant()) return BrickWalk(whole_, begin, end);
    return BrickWalk(*field_.grid, transform_point(o, field_.lattice_from_render),
                     transform_direction(d, field_.lattice_from_render), begin, end);
}

float Medium::majorant(const VoxelGrid::Brick& brick) const {
    if (gives_light_) return brick.max > 0.0f ? meeting_rate_ : 0.0f;
    const float margin = brick.is_constant() ? 1.0f : interpolation_margin;
    return brick.max * largest_sigma_ * margin * options_.majorant_factor;
}

float Medium::minorant(const VoxelGrid::Brick& brick) const {
    return brick.min * largest_sigma_ * options_.majorant_factor;
}

float Medium::field(const BrickSpan& span, const Vec3& o, const Vec3& d, float t) const {
    if (span.brick->is_constant()) return span.brick->min;
    const Vec3 p = transform_point(o + d * t, field_.lattice_from_render);
    if (has_one_majorant()) return number_at(*field_.grid, p);
    return number_in(*field_.grid, *span.brick, p - span.first);
}

Rgb Medium::albedo(const Vec3& p) const {
    if (color_.grid == nullptr) return optics_->albedo;
    const Rgb color = color_at(*color_.grid, transform_point(p, color_.lattice_from_render));
    Rgb albedo = optics_->albedo * color;
    for (int c = 0; c < 3; ++c) albedo[c] = std::clamp(albedo[c], 0.0f, 1.0f);
    return albedo;
}

Rgb Medium::emission(float field, const Vec3& p) const {
    float kelvin = 0.0f;
    if (temperature_.grid != nullptr)
        kelvin =
            optics_->temperature_scale *
            number_at(*temperature_.grid, transform_point(p, temperature_.lattice_from_render));
    const Rgb color = temperature_.grid ? glow_color(optics_->blackbody_colors, kelvin) : Rgb(1.0f);
    if (!is_thermal_) return optics_->emission * color * field;
    const float hot = kelvin / 1000.0f,
                radiance = optics_->blackbody * visible_share(kelvin) * hot * hot * hot * hot;
    const Rgb sigma_t = optics_->extinction_color * (optics_->density_scale * field);
    return sigma_t * (Rgb(1.0f) - albedo(p)) * color * radiance;
}

}  // namespace velatura::media
