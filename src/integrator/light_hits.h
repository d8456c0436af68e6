// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/sample_radiance.h"
#include "integrator/path.h"
#include "integrator/shadow_segment.h"
#include "integrator/tracer_context.h"
#include "scene/linking.h"

#include <cstdint>

namespace velatura::integrator {

/// Lights that a path finds by going where it goes: those that its segments cross, surfaces that
/// emit, and, of lights with links (docs/adr/0021), those that shine on some geometry only or whose
/// shadows some geometry casts. Weighed against light sampling by the power heuristic.
class LightHits {
  public:
    explicit LightHits(const TracerContext& context) : context_(context), world_(context.world) {}

    // Segments

    /// The lights that the present segment crosses up to t_max; infinite: also those at infinity.
    void add(const Path& path, float t_max, film::SampleRadiance& out) const;
    /// What the path's first scattered direction would find if nothing were in the way.
    void add_unoccluded(Path& path, film::SampleRadiance& out) const;
    /// Adds the lights with shadows of their own that the path's new direction meets, behind
    /// whatever casts none for them.
    void add_beyond(const Path& path,
                    const geometry::SurfacePoint& from,
                    film::SampleRadiance& out) const;

    // Surfaces that emit

    /// What the surface that the path met emits towards it.
    void add_emission(const Path& path,
                      const geometry::SurfacePoint& point,
                      const Vec3& wo,
                      film::SampleRadiance& out) const;
    lights::SurfaceRadiance surface_emission(const Path& path,
                                             const geometry::SurfacePoint& point,
                                             const Vec3& wo,
                                             float footprint) const;
    /// Calls visit(emission, weight of the path) for the surfaces that emit along the ray, one
    /// behind the other, whatever blocks them.
    template <class Visit>
    void for_each_emission(const Path& path,
                           geometry::Ray ray,
                           float cone_width,
                           const Visit& visit) const;

    // Weights

    float light_hit_weight(const Path& path, const lights::LightHit& hit) const;
    float surface_hit_weight(const Path& path, const geometry::SurfacePoint& point) const;
    Rgb light_factor(const Path& path, const lights::LobeMultipliers& multipliers) const;

    // Links

    /// Whether a light with these links shines on where the path scattered last.
    bool is_lit(const Path& path, const scene::LightLinks* links) const;
    /// Whether a light with these links is met by add_beyond() instead of where the path goes.
    bool is_found_beyond(const Path& path, const scene::LightLinks* links) const;

  private:
    bool has_rivals(const Path& path) const;
    float light_hit_pdf(const Path& path, const lights::LightHit& hit) const;
    float surface_hit_pdf(const Path& path,
                          const geometry::SurfacePoint& point,
                          lights::LightId light) const;
    void tell_emission(const Path& path,
                       const geometry::SurfacePoint& point,
                       float weight,
                       const Rgb& Le) const;
    void add_surfaces_beyond(const Path& path,
                             const CustomShadowSurfaces& surfaces,
                             film::SampleRadiance& out) const;

    const TracerContext& context_;
    const World& world_;
};

template <class Visit>
void LightHits::for_each_emission(const Path& path,
                                  geometry::Ray ray,
                                  float cone_width,
                                  const Visit& visit) const {
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        const geometry::Hit hit = world_.accelerator->intersect(ray);
        ++path.counts->shadow;
        if (!hit.is_valid()) return;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        cone_width += path.cone_spread * hit.t;
        if (world_.lights.can_emit(point)) {
            const float weight =
                world_.materials.presence(point, cone_width) * surface_hit_weight(path, point);
            visit(surface_emission(path, point, -ray.d, cone_width), weight);
        }
        ray = geometry::spawn_ray(point, ray.d);
    }
}

/// Of a path's ways through volumes to lights with shadows of their own. Lights may share them:
/// each is seen on its own.
inline sampling::RandomStream custom_shadow_numbers(const Path& path) {
    return path.sampler.stream(path.bounce, sampling::Purpose::VolumeCustomShadow, path.pass_count);
}

}  // namespace velatura::integrator
