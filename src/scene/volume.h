// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/color_decoding.h"
#include "scene/ids.h"
#include "scene/linking.h"
#include "scene/mesh.h"
#include "scene/voxel_grid.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::scene {

/// A grid of a file. Whoever translates a stage names it; media::load_volumes() reads it.
struct VolumeField {
    std::string file;      ///< resolved; may lie within a package
    std::string authored;  ///< as the stage has it, for messages
    std::string grid;      ///< name within the file
    int index = 0;         ///< among the grids of that name
    GridKind kind = GridKind::AsStored;
    ColorDecoding colors = {};  ///< of a grid of colors
    ProvenanceId provenance = none;
    std::shared_ptr<const VoxelGrid> voxels;  ///< null: not read
};

/// What the numbers of a volume's fields mean to light. All coefficients are per unit of render
/// space.
struct VolumeOptics {
    float density_scale = 1.0f;        ///< extinction per unit of density
    Rgb extinction_color = Rgb(1.0f);  ///< a factor of it
    Rgb albedo = Rgb(0.5f);  ///< share of the extinction that scatters; a factor of the color field
    float anisotropy = 0.0f;  ///< mean cosine of scattering, see media::HenyeyGreenstein
    /// Emitted radiance per unit of way and of the emission field.
    Rgb emission = Rgb(1.0f);
    float temperature_scale = 1.0f;  ///< kelvin per unit of temperature
    /// Radiance of a black body of 1000 K; others glow by the fourth power.
    float blackbody = 0.0f;
    /// Colors of black bodies of 0, 100, 200 … kelvin, of luminance 1; empty: no temperature.
    std::vector<Rgb> blackbody_colors;
};

/// A medium that scatters, absorbs and emits light, by fields. Overlapping volumes add up.
struct Volume {
    std::string name;          ///< prim path
    Mat4d render_from_volume;  ///< of one that moves, as when the shutter opens
    /// [key − 1] the same at the later keys of a volume that moves, see AffineMotion.
    std::vector<Mat4d> later_render_from_volume;
    uint32_t density = none;   ///< index into Scene::volume_fields, as the next three
    uint32_t emission = none;  ///< heat, flame …
    uint32_t temperature = none;
    uint32_t color = none;
    VolumeOptics optics;
    Box3d extent;  ///< as authored, volume space; often empty
    LinkClass link = 0;
    /// What stands in its place once its density turns out to be a level set; all but the geometry.
    Shape surface = {};
    std::vector<Primvar> surface_primvars;  ///< of that geometry
    ProvenanceId provenance = none;
};

/// Whether the density is known to be a level set: the volume is a surface then.
bool is_level_set(const Volume& volume, const std::vector<VolumeField>& fields);

/// Whether the volume scatters or takes light, and whether it gives any, as far as its optics and
/// the grids that were read tell.
bool has_extinction(const Volume& volume, const std::vector<VolumeField>& fields);
bool has_emission(const Volume& volume, const std::vector<VolumeField>& fields);

}  // namespace velatura::scene
