// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "lights/environment_image.h"
#include "lights/light_sample.h"
#include "lights/surface_emission.h"
#include "scene/affine_motion.h"
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
struct EmitterHit;
struct EmitterPoint;
struct LightBounds;

/// How a LightSet prepares and samples its lights.
struct LightSetOptions {
    /// MIS compensation: samples textured domes in proportion to the radiance above their mean.
    /// Requires an integrator that combines light and BSDF sampling by MIS at every vertex:
    /// sample() alone is then biased.
    /// Ref: Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in Multiple
    /// Importance Sampling".
    bool compensate_mis = false;

    /// Samples points of lights by area instead of by solid angle. Requires an integrator that
    /// does not combine light and BSDF sampling: hits then have no density.
    bool by_area = false;

    /// Geometry and materials that are searched for emissive triangles; set both or neither.
    /// Without them emissive triangles are not sampled and are found by BSDF sampling only. Both
    /// must outlive the LightSet.
    const geometry::GeometrySet* geometry = nullptr;
    const shading::MaterialEvaluator* materials = nullptr;
};

/// Emission of a surface point.
struct SurfaceRadiance {
    Rgb Le = Rgb(0.0f);                        ///< emitted radiance, scene-linear
    scene::GroupId group = 0;                  ///< light group that Le is deposited into
    LobeMultipliers multipliers;               ///< UsdLux diffuse and specular multipliers
    const scene::LightLinks* links = nullptr;  ///< links of the mesh light; null: no mesh light for
                                               ///< this receiver, or no links
};

/// The lights and emissive triangles of a scene, prepared for sampling.
///
/// Items: 0 … size() − 1 are Scene::lights; then emissive triangles of shapes that are placed
/// directly, one item each; then instances with emissive triangles, one item each, with the
/// triangles as parts. A LightId is an item and a part.
///
/// Analytic lights (Scene::lights) emit and do not occlude: they are not in the accelerator, and
/// for_each_hit() finds them. Emissive triangles are surfaces that rays hit in the accelerator.
///
/// Space: render space; `d`, `wi`, `wo` are unit vectors and point away from the receiver.
/// Precision: geometry is in double; results scale exactly with scenes scaled by a power of two.
/// Time: what moves is asked for at a time (Ray::time), the same for a sample, its density and
/// hits. Density: sample() agrees with for_each_hit() and surface_pdf(): for every direction they
/// have one pdf [1/sr] (LightSetOptions::by_area: only sample() has one). Threads: immutable after
/// construction, safe to share. The scene must outlive it. Ref: UsdLux; Pharr, Jakob, Humphreys,
/// "Physically Based Rendering" 4, ch. 12 (light sampling).
class LightSet {
  public:
    // Construction

    /// Prepares all lights of the scene.
    /// Args:   load: reads textures of lights; may be empty when no light has one.
    /// Errors: none. Zero sizes, broken transforms or colors, unreadable textures … are warnings at
    ///         the prim of the light.
    LightSet(const scene::Scene& scene,
             const ImageLoader& load,
             Diagnostics& diagnostics,
             const LightSetOptions& options = {});
    ~LightSet();
    LightSet(LightSet&&) noexcept;
    LightSet& operator=(LightSet&&) noexcept;

    /// Number of lights whose texture cannot be read; they emit their untextured color.
    uint32_t unread_textures() const { return unread_textures_; }

    // Items: how many there are, and what each is

    /// Number of analytic lights (Scene::lights).
    uint32_t size() const { return uint32_t(emitters_.size()); }

    /// Number of items: analytic lights, emissive triangles, instances with emissive triangles.
    uint32_t item_count() const;

    /// True for emissive triangles and instances of them, false for analytic lights.
    bool is_surface(uint32_t item) const { return item >= size(); }

    /// True for an instance with emissive triangles, whose parts are selected in a second step.
    bool is_instance(uint32_t item) const;

    /// Group of triangles in surfaces() that the instance has as parts. item: an instance.
    uint32_t group_of_instance(uint32_t item) const;

    /// Emissive triangles; null when there are none. Item i is their number i − size().
    const EmissiveSurfaces* surfaces() const { return surfaces_.get(); }

    /// The light as translated from UsdLux. index < size().
    const scene::Light& light(uint32_t index) const { return scene_->lights[index]; }

    // Properties of a light. index: of an analytic light; item: of any

    /// True when camera rays see the light itself.
    bool is_camera_visible(uint32_t index) const { return records_[index].is_camera_visible; }

    /// True when light filters act on the light.
    bool is_filtered(uint32_t index) const { return records_[index].is_filtered; }

    /// True when the light is sampled through portals: its pdf then depends on the receiver.
    bool has_portals(uint32_t index) const { return records_[index].has_portals; }

    /// True when the light can contribute; the others are neither sampled nor hit.
    bool is_on(LightId id) const;

    /// True for lights that only sampling finds: a position or a direction of zero extent.
    bool is_delta(uint32_t item) const;

    /// True for dome and distant lights.
    bool is_infinite(uint32_t item) const {
        return !is_surface(item) && records_[item].is_infinite;
    }

    /// Light group; emissive triangles that are no mesh light have Scene::emissive_group().
    scene::GroupId group(LightId id) const;

    /// UsdLux inputs:diffuse and inputs:specular.
    LobeMultipliers lobe_multipliers(LightId id) const;

    // Light linking and shadow linking (UsdLux light:link, shadow:link; scene/linking.h)

    /// True when some light illuminates a part of the geometry only (scene::LightLinks::lit).
    bool has_light_links() const { return has_light_links_; }

    /// True when some light has LightLinks::has_custom_shadows().
    bool has_custom_shadows() const { return has_custom_shadows_; }

    /// Number of link classes of the scene's geometry, see scene::Linking.
    size_t link_class_count() const { return scene_->linking.class_count; }

    /// Links of the light; null: it illuminates everything and everything casts its shadow. Those
    /// of emissive triangles that are no mesh light are scene::plain_links().
    const scene::LightLinks* links(LightId id) const;

    /// True when the light illuminates geometry of the class.
    bool illuminates(LightId id, scene::LinkClass c) const { return illuminates(links(id), c); }

    /// True when the item, or one of its parts, illuminates geometry of the class.
    bool item_illuminates(uint32_t item, scene::LinkClass c) const;

    /// True when a light with these links illuminates geometry of the class.
    bool illuminates(const scene::LightLinks* links, scene::LinkClass c) const {
        return !links || links->lit == scene::none || scene_->linking.sets[links->lit].holds(c);
    }

    // Emission of surfaces. Requires LightSetOptions::geometry and materials

    /// True when some surface can emit.
    bool has_surface_emission() const { return emission_ && emission_->has_any(); }

    /// True when the surface emits towards some receiver; a cheap test before surface_radiance().
    bool can_emit(const geometry::SurfacePoint& point) const { return emission_->can_emit(point); }

    /// Emitted radiance towards wo, not multiplied by presence.
    /// Args: footprint: width of the ray cone at the point [scene unit], filters textures;
    ///       filtered_for: position of the receiver, for light filters; null: without them.
    SurfaceRadiance surface_radiance(const geometry::SurfacePoint& point,
                                     const Vec3& wo,
                                     float footprint,
                                     EmissionReceiver emission_receiver,
                                     const Vec3* filtered_for) const;

    // Sampling of a direction from a receiver

    /// Samples a direction from the receiver p towards a light.
    /// Args:    u in [0,1)²; cone: filters textures of emissive triangles.
    /// Returns: direction, radiance and pdf [1/sr]; nullopt when the light does not reach p or the
    ///          sample misses it: a sample of value 0.
    std::optional<LightSample> sample(
        LightId id, const Vec3& p, const Vec2& u, const RayCone& cone = {}, float time = 0) const;

    /// Density [1/sr] of sample() for wi from p; 0 for delta lights and directions that miss.
    float pdf(LightId id, const Vec3& p, const Vec3& wi, float time = 0) const;

    /// Density [1/sr] of sample() for the point q of an emissive triangle from p.
    float surface_pdf(LightId id, const Vec3& p, const Vec3& q, float time = 0) const;

    // Sampling of a point on a light, independent of the receiver

    /// True for analytic lights that are on, except domes: sample_point() is defined for them.
    bool has_points(uint32_t item) const;

    /// Samples a point of an analytic light; a direction for lights at infinity.
    /// Args: index with has_points(); u in [0,1)²; facing: direction along which points that emit
    ///       that way are preferred; the density accounts for it.
    EmitterPoint sample_point(uint32_t index,
                              const Vec2& u,
                              const std::optional<Vec3d>& facing,
                              float time = 0) const;

    /// Radiance along the ray from o in direction d through the point; irradiance perpendicular to
    /// d for a delta light. Black when the ray hits another side of the light before.
    Rgb radiance_at(uint32_t index,
                    const EmitterPoint& point,
                    const Vec3d& o,
                    const Vec3d& d,
                    float time = 0) const;

    // Lights that rays hit

    /// Light of the emissive triangle that was hit; nullopt when it is not sampled.
    std::optional<LightId> find_surface(const geometry::SurfacePoint& point) const;

    /// Intersects one light, without occlusion. nullopt: the ray misses, the light lies behind o,
    /// or it is a delta light.
    std::optional<LightHit> intersect(LightId id,
                                      const Vec3& o,
                                      const Vec3& d,
                                      float time = 0) const;

    /// Calls visit(const LightHit&) for every analytic light that the segment 0 < t < t_max of the
    /// ray hits, each at most once. Lights at infinity are reported, with t = infinity, only when
    /// t_max is infinite: pass the distance of the surface hit otherwise. The order depends on the
    /// scene only.
    template <class Visitor>
    void for_each_hit(
        const Vec3& o, const Vec3& d, float t_max, float time, Visitor&& visit) const {
        for_each_hit_raw(
            o, d, t_max, time,
            [](void* v, const LightHit& hit) { (*static_cast<Visitor*>(v))(hit); }, &visit);
    }

    /// Radiance of the light itself along the ray of a hit, which is what the camera sees: light
    /// filters act on what the light illuminates.
    Rgb unfiltered_radiance(const LightHit& hit,
                            const Vec3& o,
                            const Vec3& d,
                            float time = 0) const;

    /// True when for_each_hit() with this t_max reports a hit that it reports with infinity.
    bool is_within(const LightHit& hit, float t_max) const {
        return hit.t < t_max ||
               (std::isinf(hit.t) && (std::isinf(t_max) || !is_infinite(hit.light)));
    }

    /// Background: summed radiance of the dome and non-delta distant lights in direction d, without
    /// light filters.
    Rgb background(const Vec3& d) const;

    /// True when a light of Scene::lights moves while the shutter is open; surfaces move as
    /// geometry does.
    bool has_motion() const { return !motions_.empty(); }

    // Bounds and powers for light selection

    /// Estimated flux (luminance) into a sphere of radius `scene_radius` [scene unit]; > 0 exactly
    /// when the light is on. Of an instance: the sum over its parts.
    double power(uint32_t item, double scene_radius) const;

    /// Area [scene unit²] of a finite light that is on; of an instance the area of its prototype's
    /// emissive triangles, scaled, approximate under uneven scale. 0 for lights at infinity.
    double area(uint32_t item) const;

    /// Box, cone of directions and power of a finite light that is on and no instance.
    LightBounds bounds(uint32_t item) const;

    /// Transforms bounds from the space of an instance's prototype to render space.
    LightBounds place(uint32_t item, const LightBounds& bounds) const;

    /// Irradiance (luminance) of a light at infinity that is on: of a distant light on a surface
    /// that faces it, of a dome averaged over all orientations.
    double mean_irradiance(uint32_t index) const;

    /// Fraction of the light's irradiance that sample() covers, in [0, 1]; below 1 for domes under
    /// MIS compensation.
    double sampled_share(uint32_t index) const;

  private:
    /// Properties that every hit and sample reads, contiguous for all lights.
    struct LightRecord {
        scene::GroupId group = 0;
        LobeMultipliers multipliers;
        bool is_infinite = false, is_camera_visible = true, has_portals = false;
        bool is_filtered = false;
        uint32_t motion = scene::none;  ///< of motions_
        const scene::LightLinks* links = nullptr;
    };

    void note_links(const scene::LightLinks& links);

    /// Of surfaces that emit and are no mesh light.
    const scene::LightLinks* plain_links() const {
        return plain_links_ == scene::LightLinks() ? nullptr : &plain_links_;
    }

    LightId in_surfaces(LightId id) const { return {id.index - size(), id.part}; }

    using RawVisitor = void (*)(void*, const LightHit&);
    void for_each_hit_raw(const Vec3& o,
                          const Vec3& d,
                          float t_max,
                          float time,
                          RawVisitor visit,
                          void* context) const;

    /// Null: it stays.
    const scene::AffineMotion* motion_of(uint32_t index) const {
        const uint32_t motion = records_[index].motion;
        return motion == scene::none ? nullptr : &motions_[motion];
    }

    std::optional<EmitterHit> hit_emitter(
        uint32_t index, const Vec3d& o, const Vec3d& d, float time, bool is_filtered = true) const;

    const scene::Scene* scene_;
    std::vector<std::unique_ptr<Emitter>> emitters_;  // null = off
    std::vector<LightRecord> records_;                // [analytic light]
    std::vector<scene::AffineMotion> motions_;
    uint32_t unread_textures_ = 0;
    std::vector<uint32_t> infinite_;
    std::unique_ptr<EmitterTree> finite_;
    std::unique_ptr<SurfaceEmission> emission_;
    std::unique_ptr<EmissiveSurfaces> surfaces_;
    bool has_light_links_ = false, has_custom_shadows_ = false;
    scene::LightLinks plain_links_;
};

}  // namespace velatura::lights
