// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "lights/environment_image.h"
#include "scene/scene.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace velatura::lights {

class Emitter;
class EmitterTree;
struct LightBounds;

/// A direction toward a light.
struct LightSample {
    Vec3 wi;             ///< unit, from p toward the light
    float distance = 0;  ///< to the point on the light; +infinity for distant and dome lights
    Rgb Le = Rgb(0.0f);  ///< radiance that arrives unoccluded; irradiance across wi when is_delta
    float pdf = 0;       ///< [1/sr], without the probability of picking this light; 1 when is_delta
    bool is_delta = false;  ///< no other sampler can find it: MIS weight 1
};

/// A light that a ray crosses.
struct LightHit {
    uint32_t light = 0;
    float t = 0;         ///< distance along the ray; +infinity for distant and dome lights
    Rgb Le = Rgb(0.0f);  ///< radiance toward the ray's origin
    float pdf = 0;       ///< what sample() has for this direction from the ray's origin, [1/sr]
};

struct LightSetOptions {
    /// Sample textured domes in proportion to what exceeds their mean (Karlík et al. 2019, "MIS
    /// Compensation"). Only for integrators that combine light and BSDF sampling by MIS at every
    /// vertex: sample() alone is then biased.
    bool compensate_mis = false;
};

/// The lights of a scene, ready to be sampled; light i is scene.lights[i]. Light shapes emit and do
/// not block: they are not part of the accelerator, neither stop rays nor hide one another.
/// Immutable after construction and safe to share among threads. The scene must outlive it. All
/// geometry inside is in double; results scale exactly with scenes scaled by a power of two.
/// sample() and for_each_hit() describe the same density: for every direction, the pdf of both
/// agrees.
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

    uint32_t size() const { return uint32_t(emitters_.size()); }

    const scene::Light& light(uint32_t index) const { return scene_->lights[index]; }

    scene::GroupId group(uint32_t index) const { return scene_->lights[index].group; }

    /// Whether the light can contribute at all; the others are never sampled nor hit.
    bool is_on(uint32_t index) const { return emitters_[index] != nullptr; }

    bool is_delta(uint32_t index) const;
    /// Dome and distant lights: at infinite distance.
    bool is_infinite(uint32_t index) const;

    /// Samples a direction from point p (render space) toward light `index`; u in [0,1)². Nothing
    /// when the light does not reach p or the sample fell beside it: that counts as a sample of
    /// value zero.
    std::optional<LightSample> sample(uint32_t index, const Vec3& p, const Vec2& u) const;

    /// Density [1/sr] with which sample() finds the unit direction wi from p; 0 for delta lights
    /// and directions that miss.
    float pdf(uint32_t index, const Vec3& p, const Vec3& wi) const;

    /// The light as the ray o + t·d (d unit) sees it: nothing when it misses, lies behind or is a
    /// delta light.
    std::optional<LightHit> intersect(uint32_t index, const Vec3& o, const Vec3& d) const;

    /// Calls visit(const LightHit&) for every light that the segment 0 < t < t_max of the ray
    /// crosses (d unit). Lights at infinity are reported, with t = infinity, only when t_max is
    /// infinite: pass the distance of the surface hit otherwise. Every light comes at most once.
    /// The order depends on the scene only.
    template <class Visitor>
    void for_each_hit(const Vec3& o, const Vec3& d, float t_max, Visitor&& visit) const {
        for_each_hit_raw(
            o, d, t_max, [](void* v, const LightHit& hit) { (*static_cast<Visitor*>(v))(hit); },
            &visit);
    }

    /// Estimate of the emitted flux (luminance) that enters a ball of radius `scene_radius`: for
    /// light selection, > 0 exactly when the light is on.
    double power(uint32_t index, double scene_radius) const;

    /// Box, directions and strength of a finite light that is on.
    LightBounds bounds(uint32_t index) const;

    /// Irradiance (luminance) of a light at infinity that is on: of a distant light on a surface
    /// that faces it, of a dome averaged over all surfaces.
    double mean_irradiance(uint32_t index) const;

    /// Sum of what the dome and distant lights without delta show in direction d (unit): the
    /// picture's background.
    Rgb background(const Vec3& d) const;

  private:
    using RawVisitor = void (*)(void*, const LightHit&);
    void for_each_hit_raw(
        const Vec3& o, const Vec3& d, float t_max, RawVisitor visit, void* context) const;

    const scene::Scene* scene_;
    std::vector<std::unique_ptr<Emitter>> emitters_;  // null = off
    std::vector<uint32_t> infinite_;
    std::unique_ptr<EmitterTree> finite_;
};

}  // namespace velatura::lights
