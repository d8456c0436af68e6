// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "media/brick_walk.h"
#include "media/henyey_greenstein.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>

namespace velatura::media {

/// A grid as rays of render space see it.
struct PlacedGrid {
    const scene::VoxelGrid* grid = nullptr;  ///< null: none
    Mat4 lattice_from_render = Mat4();
};

/// How bounds of a medium along a ray are found.
enum class Majorants : uint8_t {
    Bricks,  ///< brick by brick
    One,  ///< one for the whole medium, as delta tracking has it in its simplest form: to compare
};

struct MediumOptions {
    Majorants majorants = Majorants::Bricks;
    /// A factor of the bounds: below 1 they are none. For tests that somebody notices.
    float majorant_factor = 1.0f;
};

/// What one volume does to light by one of its fields: it scatters and takes it, or it gives it.
/// Light meets it at points of a Poisson process along the ray, whose rate is a bound of the
/// extinction there, or, where light is given, often enough. Of a volume that moves this is as when
/// the shutter opens; rays are carried there, and keep their parameter t.
class Medium {
  public:
    /// What scatters and takes light; nothing where the volume does not.
    static std::optional<Medium> extinction(const scene::Scene&,
                                            uint32_t volume,
                                            const MediumOptions&);
    /// What gives light.
    static std::optional<Medium> emission(const scene::Scene&,
                                          uint32_t volume,
                                          const MediumOptions&);

    bool gives_light() const { return gives_light_; }

    /// All channels have the same extinction.
    bool is_gray() const { return is_gray_; }

    uint32_t volume() const { return volume_; }

    scene::LinkClass link() const { return link_; }

    const HenyeyGreenstein& phase() const { return phase_; }

    const Box3& bounds() const { return bounds_; }  ///< render space

    /// Cuts [begin, end) of a ray of render space to what lies within; false: nothing.
    bool clip(const Vec3& o, const Vec3& d, float& begin, float& end) const;
    /// Through a part of the ray that clip() gave.
    BrickWalk walk(const Vec3& o, const Vec3& d, float begin, float end) const;

    /// Bounds of the rate at which light meets the medium in a brick: extinction of the channel
    /// that has most. [per unit of render space]
    float majorant(const scene::VoxelGrid::Brick& brick) const;
    float minorant(const scene::VoxelGrid::Brick& brick) const;

    /// Number of its field at a point of the ray within the span.
    float field(const BrickSpan& span, const Vec3& o, const Vec3& d, float t) const;

    /// Of the channel that has most, by the number of the field.
    float extinction(float field) const { return field * largest_sigma_; }

    /// Extinction of each channel over that of the channel that has most, in [0, 1].
    const Rgb& channels() const { return channels_; }

    /// Share of the extinction that scatters, at a point of render space.
    Rgb albedo(const Vec3& p) const;
    /// Radiance given per unit of way, at a point of render space where the field has this number.
    Rgb emission(float field, const Vec3& p) const;

  private:
    Medium(const scene::Scene& scene,
           uint32_t volume,
           uint32_t field,
           const MediumOptions& options);
    PlacedGrid place(const scene::Scene& scene, const scene::Volume& volume, uint32_t field) const;

    bool has_one_majorant() const { return options_.majorants == Majorants::One; }

    PlacedGrid field_, color_, temperature_;
    const scene::VolumeOptics* optics_;
    MediumOptions options_;
    HenyeyGreenstein phase_;
    Box3 bounds_;
    uint32_t volume_;
    scene::LinkClass link_;
    bool gives_light_ = false, is_gray_ = true;
    bool is_thermal_ = false;  // glows by its temperature and absorption alone
    float largest_sigma_ = 0;  // per unit of density
    Rgb channels_ = Rgb(1.0f);
    float meeting_rate_ = 0;         // where light is given
    scene::VoxelGrid::Brick whole_;  // bounds of all bricks
};

}  // namespace velatura::media
