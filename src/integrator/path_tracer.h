// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/path_observer.h"
#include "integrator/ray_counts.h"
#include "integrator/tracer_context.h"
#include "integrator/volume_segment.h"

#include <cstdint>
#include <memory>

namespace velatura::integrator {

/// Unidirectional path tracing with next-event estimation, multiple importance sampling and Russian
/// roulette, or with less of it where the estimator says so. Radiance goes into (bounce, light
/// group) cells by what the path did. Ref: Veach 1997, chapters 9 and 10; Pharr, Jakob, Humphreys
/// 2023, section 13.4.
class PathTracer {
  public:
    PathTracer(const World& world, const film::LayerSet& layers, const PathTracerOptions& options);
    PathTracer(const PathTracer&) = delete;
    PathTracer& operator=(const PathTracer&) = delete;

    /// One camera sample of pixel (x, y) of the whole image. A function of its arguments and the
    /// options alone. Where the path divides, an observer is told of one branch after the other,
    /// each with its own end.
    void trace(int x,
               int y,
               uint64_t sample,
               film::SampleRadiance& out,
               RayCounts& counts,
               PathObserver* observer = nullptr) const;

  private:
    void follow(Path& path, film::SampleRadiance& out) const;
    template <bool has_insides>
    void follow_through(Path& path, film::SampleRadiance& out) const;
    void split_path(const Path& prefix, const Vertex& vertex, film::SampleRadiance& out) const;
    const char* continue_path(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;
    void note_caustic_class(Path& path,
                            const Vertex& vertex,
                            const shading::BsdfSample& sample,
                            shading::BsdfValue& value) const;
    bool is_matte(const Path& path, const geometry::SurfacePoint& point) const;
    bool is_catcher(const Path& path, const geometry::SurfacePoint& point) const;
    film::SampleRadiance& begin_catcher(const Path& path, film::SampleRadiance& out) const;
    void trace_plate(const Path& camera_path, film::SampleRadiance& out) const;
    bool note_ray_kind(Path& path,
                       const Vertex& vertex,
                       const shading::BsdfSample& sample,
                       shading::BsdfValue& value) const;
    bool scatter(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;

    TracerContext context_;
    const World& world_;
    LightHits hits_;
    DirectLight direct_;
    ShadowAttribution attribution_;
    VolumeSegment volume_;
    std::unique_ptr<const PathTracer> plate_;  ///< only where layers ask for light of catchers
};

}  // namespace velatura::integrator
