// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "lights/environment_image.h"
#include "lights/light_sample.h"
#include "lights/surface_emission.h"
#include "scene/scene.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::geometry {
class GeometrySet;
struct SurfacePoint;
}  // namespace velatura::geometry

namespace velatura::shading {
class MaterialEvaluator;
}

namespace velatura::lights {

class EmissiveSurfaces;
class Emitter;
class EmitterTree;
struct EmitterPoint;
struct LightBounds;

struct LightSetOptions {
    /// Sample textured domes in proportion to what exceeds their mean (Karlík et al. 2019, "MIS
    /// Compensation"). Only for integrators that combine light and BSDF sampling by MIS at every
    /// vertex: sample() alone is then biased.
    bool compensate_mis = false;

    /// Choose points of lights by area instead of by solid angle, whoever looks. Only for
    /// integrators that do not combine light and BSDF sampling: hits then have no density.
    bool by_area = false;

    /// Surfaces to look for emissive triangles on, both or none: without them such triangles are
    /// only found by chance. Both must outlive the set.
    const geometry::GeometrySet* geometry = nullptr;
    const shading::MaterialEvaluator* materials = nullptr;
};

/// What a surface emits.
struct SurfaceRadiance {
    Rgb Le = Rgb(0.0f);
    scene::GroupId group = 0;
    LobeMultipliers multipliers;               ///< of who is lit by it
    const scene::LightLinks* links = nullptr;  ///< of the light that it is to the onlooker; null:
                                               ///< none, or no links
};

/// The lights of a scene and its emissive triangles, ready to be sampled.
///
/// Items 0 … size() − 1 are scene.lights. Their shapes emit and do not block: they are not part of
/// the accelerator, neither stop rays nor hide one another. After them come emissive triangles of
/// shapes placed directly, one item each, then instances with emissive triangles, one item each
/// with its triangles as parts. These are surfaces like others, found by rays in the accelerator.
///
/// Immutable after construction and safe to share among threads. The scene must outlive it. All
/// geometry inside is in double; results scale exactly with scenes scaled by a power of two.
/// sample() and for_each_hit() or surface_pdf() describe the same density: for every direction,
/// the pdf of both agrees (LightSetOptions::by_area has one of them).
class LightSet {
  public:
    /// Prepares all lights. Textures come from `load`, which may be empty when no light has one.
    /// What cannot be honoured (zero size, broken transform or colour, unreadable texture, …) is
    /// warned about at the light's prim.
    LightSet(const scene::Scene& scene,
             const ImageLoader& load,
             Diagnostics& diagnostics,
             const LightSetOptions& options = {});
    ~LightSet();
    LightSet(LightSet&&) noexcept;
    LightSet& operator=(LightSet&&) noexcept;

    /// Lights of the scene whose texture cannot be read: they emit without it.
    uint32_t unread_textures() const { return unread_textures_; }

    /// Lights of the scene.
    uint32_t size() const { return uint32_t(emitters_.size()); }

    /// All items.
    uint32_t item_count() const;

    bool is_surface(uint32_t item) const { return item >= size(); }

    /// The item is an instance, whose parts are chosen among.
    bool is_instance(uint32_t item) const;
    /// Its group in surfaces().
    uint32_t group_of_instance(uint32_t item) const;

    /// The emissive triangles; null when there are none. Item i is theirs with number i − size().
    const EmissiveSurfaces* surfaces() const { return surfaces_.get(); }

    const scene::Light& light(uint32_t index) const { return scene_->lights[index]; }

    /// Whether the camera sees the light of the scene where it shines itself.
    bool is_camera_visible(uint32_t index) const { return facts_[index].is_camera_visible; }

    /// Whether the light of the scene is sampled through portals: its density then depends on the
    /// very point that samples.
    bool has_portals(uint32_t index) const { return facts_[index].has_portals; }

    /// Light group; of emissive triangles that are no mesh light Scene::emissive_group().
    scene::GroupId group(LightId id) const;

    /// UsdLux's factors of what a light does to diffuse and to other lobes.
    LobeMultipliers lobe_multipliers(LightId id) const;

    /// Whether some light shines on a part of the geometry only, see scene::LightLinks::lit.
    bool has_light_links() const { return has_light_links_; }

    /// Whether some light has LightLinks::has_own_shadows().
    bool has_own_shadows() const { return has_own_shadows_; }

    /// See scene::Linking.
    size_t link_class_count() const { return scene_->linking.class_count; }

    /// What the light is linked to; null: to everything.
    const scene::LightLinks* links(LightId id) const;

    /// Whether geometry of the class is lit by the light, or at least by a part of the item.
    bool shines_on(LightId id, scene::LinkClass c) const { return shines_on(links(id), c); }

    bool item_shines_on(uint32_t item, scene::LinkClass c) const;

    bool shines_on(const scene::LightLinks* links, scene::LinkClass c) const {
        return !links || links->lit == scene::none || scene_->linking.sets[links->lit].holds(c);
    }

    /// Whether any surface may emit.
    bool has_surface_emission() const { return emission_ && emission_->has_any(); }

    /// Whether somebody may see the surface emit. This and the next need surfaces to look for
    /// emission on, see LightSetOptions.
    bool may_emit(const geometry::SurfacePoint& point) const { return emission_->may_emit(point); }

    /// What the surface emits towards wo, not weighed by presence.
    SurfaceRadiance surface_radiance(const geometry::SurfacePoint& point,
                                     const Vec3& wo,
                                     float footprint,
                                     Onlooker onlooker) const;

    /// Whether the light can contribute at all; the others are never sampled nor hit.
    bool is_on(LightId id) const;

    bool is_delta(uint32_t item) const;

    /// Dome and distant lights: at infinite distance.
    bool is_infinite(uint32_t item) const { return !is_surface(item) && facts_[item].is_infinite; }

    /// Samples a direction from point p (render space) toward a light; u in [0,1)². Nothing when
    /// the light does not reach p or the sample fell beside it: that counts as a sample of value
    /// zero. `cone` filters the textures of emissive triangles.
    std::optional<LightSample> sample(LightId id,
                                      const Vec3& p,
                                      const Vec2& u,
                                      const RayCone& cone = {}) const;

    /// Density [1/sr] with which sample() finds the unit direction wi from p; 0 for delta lights
    /// and directions that miss.
    float pdf(LightId id, const Vec3& p, const Vec3& wi) const;

    /// Whether sample_point() has points of this light: those of the scene that are on, but domes.
    bool has_points(uint32_t item) const;

    /// A point of a light of the scene, of one at infinity a direction, chosen without regard to
    /// who looks; u in [0,1)². facing: unit direction along which to look for points that emit that
    /// way, a hint that the density knows. Ask has_points() first.
    EmitterPoint sample_point(uint32_t index,
                              const Vec2& u,
                              const std::optional<Vec3d>& facing) const;

    /// Radiance that a ray from o along d (unit) through the point meets there, irradiance across d
    /// for a delta light; black when it meets another side of the light before.
    Rgb radiance_at(uint32_t index,
                    const EmitterPoint& point,
                    const Vec3d& o,
                    const Vec3d& d) const;

    /// Item and part of the triangle that was hit; nothing when it is not one that can be sampled.
    std::optional<LightId> find_surface(const geometry::SurfacePoint& point) const;

    /// Density [1/sr] with which sample() finds the point q of an emissive triangle from p.
    float surface_pdf(LightId id, const Vec3& p, const Vec3& q) const;

    /// The light as the ray o + t·d (d unit) sees it, as if nothing else were there: nothing when
    /// it misses, lies behind or is a delta light.
    std::optional<LightHit> intersect(LightId id, const Vec3& o, const Vec3& d) const;

    /// Calls visit(const LightHit&) for every light of the scene that the segment 0 < t < t_max of
    /// the ray crosses (d unit). Lights at infinity are reported, with t = infinity, only when
    /// t_max is infinite: pass the distance of the surface hit otherwise. Every light comes at most
    /// once. The order depends on the scene only.
    template <class Visitor>
    void for_each_hit(const Vec3& o, const Vec3& d, float t_max, Visitor&& visit) const {
        for_each_hit_raw(
            o, d, t_max, [](void* v, const LightHit& hit) { (*static_cast<Visitor*>(v))(hit); },
            &visit);
    }

    /// Whether for_each_hit() with this t_max reports a hit that it reports with an infinite one.
    bool is_within(const LightHit& hit, float t_max) const {
        return hit.t < t_max ||
               (std::isinf(hit.t) && (std::isinf(t_max) || !is_infinite(hit.light)));
    }

    /// Estimate of the emitted flux (luminance) that enters a ball of radius `scene_radius`: for
    /// light selection, > 0 exactly when the light is on; of an instance that of all its parts.
    double power(uint32_t item, double scene_radius) const;

    /// Area of a finite light that is on, of an instance of its emissive triangles that of its
    /// prototype's, scaled: about, where the scale is uneven. 0 for lights at infinity.
    double area(uint32_t item) const;

    /// Box, directions and strength of a finite light that is on and no instance.
    LightBounds bounds(uint32_t item) const;

    /// Bounds in the space of an instance's prototype, carried to where the instance is.
    LightBounds place(uint32_t item, const LightBounds& bounds) const;

    /// Irradiance (luminance) of a light at infinity that is on: of a distant light on a surface
    /// that faces it, of a dome averaged over all surfaces.
    double mean_irradiance(uint32_t index) const;

    /// Part of a light's irradiance that sample() is there to find, in [0, 1]: below 1 for domes
    /// under MIS compensation.
    double sampled_share(uint32_t index) const;

    /// Sum of what the dome and distant lights without delta show in direction d (unit): the
    /// picture's background.
    Rgb background(const Vec3& d) const;

  private:
    /// What every meeting with a light asks for, of many lights in one place.
    struct Facts {
        scene::GroupId group = 0;
        LobeMultipliers multipliers;
        bool is_infinite = false, is_camera_visible = true, has_portals = false;
        const scene::LightLinks* links = nullptr;
    };

    void note_links(const scene::LightLinks& links);

    LightId in_surfaces(LightId id) const { return {id.index - size(), id.part}; }

    using RawVisitor = void (*)(void*, const LightHit&);
    void for_each_hit_raw(
        const Vec3& o, const Vec3& d, float t_max, RawVisitor visit, void* context) const;

    const scene::Scene* scene_;
    std::vector<std::unique_ptr<Emitter>> emitters_;  // null = off
    std::vector<Facts> facts_;                        // of lights of the scene
    uint32_t unread_textures_ = 0;
    std::vector<uint32_t> infinite_;
    std::unique_ptr<EmitterTree> finite_;
    std::unique_ptr<SurfaceEmission> emission_;
    std::unique_ptr<EmissiveSurfaces> surfaces_;
    bool has_light_links_ = false, has_own_shadows_ = false;
};

}  // namespace velatura::lights
