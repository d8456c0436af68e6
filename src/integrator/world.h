// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "accel/accelerator_factory.h"
#include "accel/bvh.h"
#include "base/diagnostics.h"
#include "camera/camera_model.h"
#include "geometry/geometry_set.h"
#include "geometry/refinement.h"
#include "geometry/subdivider.h"
#include "integrator/interior.h"
#include "integrator/interior_media.h"
#include "integrator/nested_dielectrics.h"
#include "integrator/subsurface_walk.h"
#include "lights/light_selector.h"
#include "lights/light_set.h"
#include "media/volume_set.h"
#include "scene/scene.h"
#include "shading/material_evaluator.h"

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::integrator {

struct WorldOptions {
    int width = 0, height = 0;  ///< whole image, pixels
    lights::SelectionKind light_selection = lights::SelectionKind::Tree;
    const accel::AcceleratorFactory* accelerator = nullptr;  ///< nullptr = the own BVH
    std::optional<accel::BvhQuality> bvh_quality =
        {};  ///< of the own BVH; by default chosen by expected_rays
    double expected_rays = 0;
    scene::EffectSet forced =
        {};  ///< effects that run though the scene does not call for them; see is_forceable
    const geometry::Subdivider* subdivider =
        nullptr;  ///< nullptr = meshes with a subdivision scheme are their polygons
    geometry::DicingOptions dicing = {};
    media::MediumOptions media = {};
    float texture_bias = 0;  ///< mip levels, see MaterialEvaluator
    size_t texture_bytes = shading::TextureCache::usual_bytes;  ///< of their cache
    bool samples_light_area =
        false;  ///< points of lights by area, whoever looks; only where light sampling is alone
    bool compensate_mis = true;  ///< only where light sampling is always combined with BSDF
                                 ///< sampling; see LightSetOptions
};

/// Seconds spent on preparing a frame.
struct WorldTimes {
    double tessellate_s = 0;
    double accelerator_s = 0;
    double lights_s = 0;
};

/// What of a scene has changed since its world was made.
struct WorldChange {
    bool geometry = false;   ///< shapes, but neither primvars' names nor textures
    bool placement = false;  ///< of instances, whose number is the same
    bool materials = false;  ///< whose textures are the same; displaced meshes are `geometry`
    bool lights = false;
    bool camera = false;  ///< or the size of the image; meshes stay as fine as they are

    bool is_any() const { return geometry || placement || materials || lights || camera; }
};

/// Geometry that is light, with the same shadows of its own.
struct CustomShadowSurfaces {
    scene::LightLinks links;            ///< `lit` has no meaning
    std::optional<scene::LinkSet> met;  ///< they and their casters; none = everything

    bool is_of(const scene::LightLinks& light) const {
        scene::LightLinks shadows = light;
        shadows.lit = scene::none;
        return shadows == links;
    }
};

/// Everything that rays need, made from a Scene, which must outlive it. Immutable but for update().
struct World {
    World(const scene::Scene& scene,
          const WorldOptions& options,
          const lights::ImageLoader& load_image,
          Diagnostics& diagnostics);
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    /// Follows a scene that has changed, and makes only what depends on that: a camera neither
    /// trees nor tables, a light no geometry, an instance no tree of a prototype. Not while rays
    /// are traced; what holds on to this world (tracers, what was learned) is to be made anew.
    void update(const WorldChange& change, int width, int height, Diagnostics& diagnostics);

    /// Of the whole image, pixels.
    int width() const { return options_.width; }

    int height() const { return options_.height; }

    /// Whether some light has links of whatever kind.
    bool has_links() const { return has_light_links || has_custom_shadows; }

    /// What rays of the kind meet; null: everything.
    const scene::LinkSet* visible_to(scene::RayKind kind) const { return visible[size_t(kind)]; }

    /// The closest hit of a ray of the kind.
    geometry::Hit intersect(const geometry::Ray& ray, scene::RayKind kind) const;

    /// Whether anything of the material is in the set.
    bool casts(scene::LinkSetId set, scene::MaterialId material) const {
        return caster_materials[set][material];
    }

    const scene::Scene& scene;
    WorldTimes times;
    geometry::RefinementStats refinement;
    shading::MaterialEvaluator materials;
    geometry::GeometrySet geometry;
    std::unique_ptr<accel::Accelerator> accelerator;
    std::unique_ptr<media::VolumeSet> volumes;  ///< null where there are none
    lights::LightSet lights;
    std::unique_ptr<lights::LightSelector> selector;
    camera::CameraModel camera;
    bool uses_lens = false;  ///< rays start all over the lens
    bool has_motion =
        false;  ///< something moves while the shutter is open: camera rays have a time
    bool chooses_lights = false;  ///< one light of several has to be picked for light sampling
    bool has_very_many_lights = false;  ///< see lights::wants_fine_numbers
    /// What a point (render space) is inside of at a time, found by rays to where nothing is.
    Interior interior_at(const Vec3& p, float time) const;

    std::unique_ptr<const SubsurfaceWalk>
        subsurface;  ///< of scenes in which light scatters below surfaces
    std::unique_ptr<const InteriorMedia>
        interior_media;  ///< of scenes with MaterialEvaluator::has_interior_media() alone
    std::unique_ptr<const NestedDielectrics> nested;  ///< of scenes with priorities alone
    bool interior_changes = false;    ///< camera_interior depends on the time, and is not kept
    Interior camera_interior;         ///< what the camera is inside of; only looked for where
                                      ///< MaterialEvaluator::has_absorption()
    bool has_light_links = false;     ///< some light shines on a part of the geometry only
    bool has_custom_shadows = false;  ///< of some light, see scene::LightLinks
    std::vector<CustomShadowSurfaces> custom_shadow_surfaces;
    bool has_lobe_multipliers =
        false;  ///< some light has a diffuse or specular multiplier other than 1
    std::vector<std::vector<bool>>
        caster_materials;             ///< [set][material]; only where something absorbs
    bool has_ray_visibility = false;  ///< something is invisible to rays of some kind
    bool tells_rays_apart = false;    ///< that, or something is a matte or a catcher
    /// [RayKind] what rays of the kind meet; null: everything.
    std::array<const scene::LinkSet*, scene::ray_kind_count> visible = {};
    const scene::LinkSet* mattes = nullptr;    ///< held out of the image; null: nothing
    const scene::LinkSet* catchers = nullptr;  ///< see scene::Linking; null: nothing
    /// What a plate of the catchers shows, scene::plate_of(); only of a scene with catchers.
    std::unique_ptr<World> plate;

  private:
    World(std::unique_ptr<scene::Scene> plate,
          const WorldOptions& options,
          const lights::ImageLoader& load_image,
          Diagnostics& diagnostics);
    void make_dielectrics();
    void make_plate();
    void update_plate(const WorldChange& change);
    void set_facts();

    WorldOptions options_;
    lights::ImageLoader load_image_;
    std::unique_ptr<scene::Scene> plate_scene_;  ///< of the world of a plate
};

}  // namespace velatura::integrator
