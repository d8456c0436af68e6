// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"
#include "scene/ies_profile.h"
#include "scene/light_filter.h"
#include "scene/linking.h"
#include "scene/texture.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::scene {

enum class LightKind : uint8_t { Distant, Dome, Rect, Disk, Sphere, Cylinder };

enum class DomeFormat : uint8_t { Automatic, LatLong, MirrorBall, Angular, CubeMapVerticalCross };

/// UsdLuxShapingAPI. A light whose cone nobody authored has none, though the schema's fallback is
/// 90 degrees: a ShapingAPI without opinions does not halve a sphere.
struct Shaping {
    float cone_angle_deg = 180.0f;  ///< half angle off the axis −Z of light space; 180 = no cone
    float cone_softness = 0.0f;     ///< [0, 1]
    float focus = 0.0f;
    Rgb focus_tint = Rgb(0.0f);
    bool is_active = false;  ///< of cone and focus: whether they change anything

    std::shared_ptr<const IesProfile> ies;  ///< null: none
    float ies_angle_scale = 0.0f;           ///< UsdLux `shaping:ies:angleScale`
    bool ies_normalize = false;             ///< by its mean intensity
};

/// A UsdLux light. Light space is the prim's own space; sizes are in it, the affine transform
/// deforms the shape. Light shapes emit, they do not block other light (docs/adr: light shapes are
/// non-occluding emitters).
struct Light {
    LightKind kind = LightKind::Sphere;
    std::string name;  ///< prim path
    GroupId group = 0;
    /// Emitted radiance before texture and shaping: color × blackbody × intensity × 2^exposure,
    /// divided by the world-space size where `normalize` is on. For a Distant light of angle 0:
    /// irradiance on a facing surface.
    Rgb Le = Rgb(1.0f);
    Mat4d render_from_light;  ///< of one that moves, as when the shutter opens
    /// [key − 1] the same at the later keys of a light that moves, see AffineMotion; its filters
    /// are carried along.
    std::vector<Mat4d> later_render_from_light;
    float width = 1.0f, height = 1.0f;  ///< Rect: x, y
    float radius = 0.5f;                ///< Disk, Sphere, Cylinder
    float length = 1.0f;                ///< Cylinder, along x
    float angle_deg = 0.53f;            ///< Distant: full apex angle
    Shaping shaping;
    std::string texture_file;  ///< Rect, Dome: resolved path; empty = none
    TexelColors texture_colors;
    DomeFormat dome_format = DomeFormat::Automatic;
    /// Dome: windows through which it is seen, unit squares around the origin of their xy planes;
    /// light comes through them towards −Z. They guide sampling and change no image.
    std::vector<Mat4d> render_from_portals;
    float diffuse_multiplier = 1.0f, specular_multiplier = 1.0f;
    std::vector<LightFilter> filters;  ///< in the order in which they act
    bool is_camera_visible = true;
    LightLinks links;
    /// The same light as one before it, for geometry that fewer of its filters are linked to.
    bool is_filter_copy = false;
    ProvenanceId provenance = none;
};

/// Geometry that is a light: a prim of shapes with UsdLux LightAPI or MeshLightAPI. Unlike other
/// lights it is a surface, which rays meet in the accelerator and which blocks light. Both of its
/// sides emit.
struct MeshLight {
    std::string name;      ///< prim path
    GroupId group = none;  ///< none: it stands nowhere
    /// Radiance that it lights other things with, before shaping: color × blackbody × intensity ×
    /// 2^exposure, times the material's emission where `is_tinted_by_emission`, divided by the area
    /// of its placement where `is_normalized`.
    Rgb Le = Rgb(1.0f);
    bool is_tinted_by_emission = false;  ///< materialSyncMode materialGlowTintsLight
    /// The camera and delta reflections see the material's emission instead: every materialSyncMode
    /// but noMaterialResponse.
    bool shows_material = false;
    bool is_normalized = false;
    Shaping shaping;
    Mat4d parent_from_light;  ///< the prim's own space, whose −Z is the axis of the shaping, in the
                              ///< space of its shape
    /// [key − 1] the same at the later keys of a shape that moves by its points.
    std::vector<Mat4d> later_parent_from_light;
    float diffuse_multiplier = 1.0f, specular_multiplier = 1.0f;
    std::vector<LightFilter> filters;  ///< in the order in which they act
    LightLinks links;
    ProvenanceId provenance = none;
};

/// One row of the light mixer.
struct LightGroup {
    std::string name;                ///< [A-Za-z0-9]+, unique
    std::vector<std::string> prims;  ///< prim paths of its lights
    bool is_environment = false;     ///< every light of it is a dome: part of the alias `env`
    std::string label = {};  ///< what the scene calls it, where that is no such name; else empty
};

}  // namespace velatura::scene
