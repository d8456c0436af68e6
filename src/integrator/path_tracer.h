// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "guiding/guiding_field.h"
#include "integrator/branch_map.h"
#include "integrator/caustics.h"
#include "integrator/direction_mixture.h"
#include "integrator/estimator.h"
#include "integrator/matte_ids.h"
#include "integrator/ray_counts.h"
#include "integrator/roulette_gains.h"
#include "integrator/shadow_shares.h"
#include "integrator/world.h"
#include "sampling/filter.h"
#include "sampling/sampler.h"

#include <cstdint>
#include <optional>

namespace velatura::integrator {

struct Look;

/// Looks at one path while it is traced, for `--replay`. Called in the order of events.
class PathObserver {
  public:
    virtual ~PathObserver() = default;
    virtual void on_hit(int bounce,
                        const geometry::SurfacePoint& point,
                        float t,
                        const Rgb& beta) = 0;

    /// The path collides in a volume at p, a distance t on; beta before it does.
    virtual void on_volume(int bounce, const Vec3& p, float t, const Rgb& beta) {
        (void)bounce, (void)p, (void)t, (void)beta;
    }

    virtual void on_deposit(int bounce,
                            scene::GroupId group,
                            const Rgb& radiance,
                            const char* what) = 0;

    /// The path may scatter at `at` by lobes that are no delta; beta before it does. Lights sampled
    /// there came before.
    virtual void on_vertex(const guiding::Place& at, const Rgb& beta) { (void)at, (void)beta; }

    /// It did, and goes on along wi. Not called for delta lobes.
    virtual void on_scatter(const Vec3& wi) { (void)wi; }

    /// The path outlived a chance to end, of a roulette that is not the default; carried: of what
    /// it began with, largest channel.
    virtual void on_survival(int bounce, float carried) { (void)bounce, (void)carried; }

    virtual void on_end(int bounce, const char* why) = 0;
};

struct PathTracerOptions {
    uint64_t seed = 0;
    int max_depth = 0;  ///< scatterings after which paths are cut; 0 = never
    sampling::FilterKind filter = sampling::FilterKind::BlackmanHarris;
    EstimatorOptions estimator = {};
    sampling::SamplerKind sampler = sampling::SamplerKind::Sobol;
    bool disable_lens = false;  ///< UsdRenderSettings disableDepthOfField
    const guiding::GuidingField* guide =
        nullptr;  ///< learned beforehand, must outlive the tracer; null = none
    /// How many ways a path goes on from its first vertex with lobes that are no delta, at an equal
    /// share each; must outlive the tracer; null = one.
    const BranchMap* branches = nullptr;
    const RouletteGains* roulette =
        nullptr;  ///< of Roulette::Efficiency, must outlive the tracer; null = no trial told yet
    const MatteIds* mattes =
        nullptr;        ///< says whose each sample is, must outlive the tracer; null = nobody asks
    bool deep = false;  ///< says how far away each sample is, see SampleRadiance::cover
    const CausticSampler* caustics =
        nullptr;  ///< solves for caustics, must outlive the tracer; null = paths find all light
};

/// Unidirectional path tracing with next-event estimation, multiple importance sampling and Russian
/// roulette, or with less of it where the estimator says so. Radiance goes into (bounce, light
/// group) cells by what the path did. Ref: Veach 1997, chapters 9 and 10; Pharr, Jakob, Humphreys
/// 2023, section 13.4.
class PathTracer {
  public:
    PathTracer(const World& world, const film::LayerSet& layers, const PathTracerOptions& options);

    /// One camera sample of pixel (x, y) of the whole picture. A function of its arguments and the
    /// options alone. Where the path divides, an observer is told of one branch after the other,
    /// each with its own end.
    void trace(int x,
               int y,
               uint64_t sample,
               film::SampleRadiance& out,
               RayCounts& counts,
               PathObserver* observer = nullptr) const;

  private:
    struct Path;
    struct Vertex;
    struct Emergence;

    /// A light that was sampled, and its links if it has any.
    struct ChosenLight {
        lights::LightChoice choice;
        lights::LightSample light;
        const scene::LightLinks* links = nullptr;
    };

    /// What scatters a path that is at no surface, wherever in it.
    struct Scatterer;

    /// What became of a path on a segment through matter.
    enum class Crossing : uint8_t { Through, Scattered, Ended };

    /// Chooses a light and a direction towards it; false when none arrives there.
    bool choose_light(const Path& path,
                      const lights::Receiver& receiver,
                      ChosenLight& chosen) const;
    /// Deposits Ld of the light, as far as it arrives.
    void deposit_direct(Path& path,
                        const geometry::SurfacePoint& from,
                        const Vec3& wo,
                        const ChosenLight& chosen,
                        const Rgb& Ld,
                        film::SampleRadiance& out,
                        const NestedBodies::Crossing* crossing = nullptr) const;
    /// Adds what volumes and lights give along the segment, and lets the path scatter if it
    /// collides before t_max. body: what scatters in the body that the path is in, or null. end:
    /// why it ended, if it did.
    Crossing cross_matter(Path& path,
                          const BodyMedia::Medium* body,
                          float t_max,
                          const char*& end,
                          film::SampleRadiance& out) const;
    const char* scatter_in_matter(Path& path,
                                  const Scatterer& matter,
                                  const Vec3& p,
                                  film::SampleRadiance& out) const;
    void deposit_sampled_in_matter(Path& path,
                                   const Scatterer& matter,
                                   const geometry::SurfacePoint& point,
                                   const ChosenLight& chosen,
                                   film::SampleRadiance& out) const;
    void add_direct_light_in_matter(Path& path,
                                    const Scatterer& matter,
                                    const geometry::SurfacePoint& point,
                                    film::SampleRadiance& out) const;
    Rgb volume_transmittance(const Path& path,
                             const Vec3& p,
                             const lights::LightSample& light) const;
    void add_light_hits(const Path& path, float t_max, film::SampleRadiance& out) const;
    void add_unoccluded_hits(Path& path, film::SampleRadiance& out) const;
    /// Tells visit(what it emits, weight of the path) of the surfaces that emit, one behind the
    /// other.
    template <class Visit>
    void for_each_emission(const Path& path,
                           geometry::Ray ray,
                           float cone_width,
                           const Visit& visit) const;
    /// The path's first scattered direction ends, a distance t on: credits the caster with what it
    /// takes of the lights beyond. behind: where that lies. taken: radiance of the path that is not
    /// let through.
    void credit_caster(const Path& path,
                       float t,
                       scene::CasterId caster,
                       const Rgb& taken,
                       const geometry::Ray& behind,
                       film::SampleRadiance& out) const;
    void credit_surface(const Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    void deposit_taken(const ShadowShares& shares,
                       scene::GroupId group,
                       const Rgb& radiance,
                       film::SampleRadiance& out) const;

    /// Whether what is found now belongs to the layers by caster: the light of the first
    /// scattering.
    bool credits_casters(int bounce) const { return has_caster_layers_ && bounce == 1; }

    /// Whether a light with these links shines on where the path scattered last.
    bool is_lit(const Path& path, const scene::LightLinks* links) const;
    /// Whether a light with these links is met by add_lights_beyond() instead of where the path
    /// goes.
    bool is_found_beyond(const Path& path, const scene::LightLinks* links) const;
    /// Adds the lights with shadows of their own that the path's new direction meets, behind
    /// whatever casts none for them.
    void add_lights_beyond(const Path& path,
                           const geometry::SurfacePoint& from,
                           film::SampleRadiance& out) const;
    void add_surfaces_beyond(const Path& path,
                             const OwnShadowSurfaces& surfaces,
                             film::SampleRadiance& out) const;
    void add_direct_light(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    /// Deposits the direct light of one that was sampled for the vertex.
    void deposit_sampled(Path& path,
                         const Vertex& vertex,
                         const ChosenLight& chosen,
                         film::SampleRadiance& out) const;
    /// Direct light by a direction of the vertex's own, see LightSampling::Hemisphere.
    void add_light_around(Path& path,
                          const Vertex& vertex,
                          const lights::Receiver& receiver,
                          film::SampleRadiance& out) const;
    template <class Give>
    void for_each_light_along(const Path& path,
                              const geometry::SurfacePoint& from,
                              const lights::Receiver& receiver,
                              const Look& look,
                              const Give& give) const;
    void add_caustics(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    bool pass_through(Path& path, const geometry::SurfacePoint& point) const;
    bool pass_straight(Path& path, const Vertex& vertex) const;
    /// False: what was met is no boundary between bodies, and the path goes on. crossing: if it is
    /// one, made in `room`.
    bool meet_bodies(Path& path,
                     const geometry::SurfacePoint& point,
                     std::optional<NestedBodies::Crossing>& room,
                     const NestedBodies::Crossing*& crossing) const;
    /// Chooses between scattering at the vertex and below it. False: absorbed there. out: where the
    /// path came out, if it went in.
    bool go_below(Path& path, const Vertex& vertex, std::optional<Emergence>& out) const;
    static void go_straight_on(Path& path, const geometry::SurfacePoint& point);
    void follow(Path& path, film::SampleRadiance& out) const;
    template <bool has_insides>
    void follow_through(Path& path, film::SampleRadiance& out) const;
    void branch_out(const Path& trunk, const Vertex& vertex, film::SampleRadiance& out) const;
    const char* go_on(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    bool scatter(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    bool survives_roulette(Path& path) const;
    /// By a roulette that is not the default.
    bool survives_otherwise(Path& path) const;
    Rgb visibility(const Path& path,
                   const geometry::SurfacePoint& from,
                   const Interior& inside,
                   const lights::LightSample& light,
                   ShadowShares* shares) const;
    Rgb own_visibility(const Path& path,
                       const geometry::SurfacePoint& from,
                       const Interior& inside,
                       const lights::LightSample& light,
                       const scene::LightLinks& links,
                       ShadowShares* shares) const;
    void record_first_collision(const Scatterer& matter,
                                const Vec3& p,
                                film::SampleRadiance& out) const;
    void record_first_hit(const geometry::SurfacePoint& point,
                          const shading::Bsdf& bsdf,
                          film::SampleRadiance& out) const;
    void deposit(const Path& path,
                 int bounce,
                 scene::GroupId group,
                 const Rgb& radiance,
                 const char* what,
                 film::SampleRadiance& out) const;
    /// Deposits light that the path met and that counts by multipliers.
    void deposit_met(const Path& path,
                     scene::GroupId group,
                     const Rgb& radiance,
                     const lights::LobeMultipliers& multipliers,
                     const char* what,
                     film::SampleRadiance& out) const;
    void add_unoccluded_met(scene::GroupId group,
                            const Rgb& radiance,
                            const lights::LobeMultipliers& multipliers,
                            film::SampleRadiance& out) const;
    float light_hit_weight(const Path& path, const lights::LightHit& hit) const;
    float surface_hit_weight(const Path& path, const geometry::SurfacePoint& point) const;
    Rgb light_factor(const Path& path, const lights::LobeMultipliers& multipliers) const;
    lights::SurfaceRadiance surface_emission(const Path& path,
                                             const geometry::SurfacePoint& point,
                                             const Vec3& wo,
                                             float footprint) const;

    const World& world_;
    PathTracerOptions options_;
    sampling::PixelFilter filter_;
    bool has_unoccluded_, has_caster_layers_, has_data_layers_;
    bool has_emission_;  ///< some surface emits
    int depth_limit_;
};

}  // namespace velatura::integrator
