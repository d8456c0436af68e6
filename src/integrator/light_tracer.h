// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "film/path_event.h"
#include "integrator/caustic_paths.h"
#include "integrator/direct_light.h"
#include "integrator/path.h"
#include "integrator/tracer_context.h"
#include "sampling/kd_warp.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::integrator {

/// Light of one path from a light to the camera.
struct Splat {
    Vec2 film_point;  ///< pixels of the whole image
    Rgb radiance;     ///< times pixels²: what the image gets where the filter is 1 per pixel²
    float path_value = 0;  ///< luminance of the same path if a camera path finds it, about
    uint16_t group = 0;    ///< light group
    uint16_t bounce = 0;
    /// Index into Splats::events of the first of `bounce` scatterings, camera first. Only where
    /// layers tell paths apart.
    uint32_t events = 0;
};

/// Splats in the order in which they were found.
struct Splats {
    std::vector<Splat> splats;
    std::vector<film::EventShares> events;
};

/// Light that comes to a surface with wide lobes from narrow lobes alone.
struct CausticArrival {
    Vec3 p, n;                      ///< render space; n on the side of the light
    Vec3 wi;                        ///< unit, away from the surface
    Rgb flux = Rgb(0.0f);           ///< of the photon
    Rgb path_radiance = Rgb(0.0f);  ///< that a camera path brings from there, times its weight
};

/// Where photons begin, and how many there are.
struct LightEmission {
    sampling::KdWarp warp;           ///< of the numbers that photons begin with
    double photons_per_pixel = 0.5;  ///< of the image, in each pass
};

/// Light tracing: paths that begin at lights and are connected to the camera. Finds caustics that
/// are seen directly, which camera paths meet at random only: the paths of
/// PathTracerOptions::caustic_paths.
///
/// A photon begins at a point of a caster, by area, lit by a light that is sampled from there; it
/// leaves by a narrow lobe, and each later wide lobe is connected to the camera. The random numbers
/// that choose caster, point, light and lobe are warped by what was learned.
/// Random numbers: a function of seed, pass and photon. Passes of even and of odd numbers know
/// nothing of each other, so that half images stay independent.
/// Ref: Arvo 1986, "Backward Ray Tracing"; Veach 1997, section 5.3 (shading normals of light paths)
/// and 10.3.
/// Threads: immutable, safe to share; world and layers must outlive it.
class LightTracer {
  public:
    LightTracer(const World& world,
                const film::LayerSet& layers,
                const PathTracerOptions& options,
                const LightEmission& emission = {});
    LightTracer(const LightTracer&) = delete;
    LightTracer& operator=(const LightTracer&) = delete;

    /// Photons of one pass, for the whole image.
    uint64_t photons_per_pass() const { return photons_per_pass_; }

    /// Layers tell paths apart: splats have their events.
    bool has_path_layers() const { return has_path_layers_; }

    const sampling::PixelFilter& filter() const { return context_.filter; }

    /// Traces photons [first, end) of a pass. Each counts as if it were alone: the image of a pass
    /// is the mean over its photons.
    /// Args: reach: pixels beyond the window for which splats are kept, too.
    void trace(uint64_t pass,
               uint64_t first,
               uint64_t end,
               const film::Window& window,
               float reach,
               Splats& out,
               RayCounts& counts) const;

    /// Random numbers that a photon begins with: of the caster, the piece of it, the point and
    /// direction there (CasterNumbers), the light, and the lobe.
    struct Beginning {
        sampling::KdWarp::Point u{};  ///< warped
        double density = 1;           ///< of u
    };

    /// The same of one photon.
    Beginning trace(uint64_t pass,
                    uint64_t photon,
                    const film::Window& window,
                    float reach,
                    Splats& out,
                    RayCounts& counts) const;

    /// Traces photons [first, end) of pass 0 as far as they go by narrow lobes, and records where
    /// they arrive in between. Each counts as if it were alone. Not of lights without extent, which
    /// camera paths cannot find.
    void record(uint64_t first,
                uint64_t end,
                std::vector<CausticArrival>& out,
                RayCounts& counts) const;

  private:
    struct Photon;

    void sample_beginning(Photon& photon) const;
    std::optional<CasterPoint> sample_caster(Photon& photon) const;
    bool begin(Photon& photon) const;
    void follow(Photon& photon) const;
    void arrive(Photon& photon,
                const geometry::SurfacePoint& point,
                const NestedDielectrics::Crossing* crossing,
                const Vec3& wi) const;
    void connect(Photon& photon,
                 const geometry::SurfacePoint& point,
                 const NestedDielectrics::Crossing* crossing,
                 const Vec3& wi) const;
    bool scatter(Photon& photon,
                 const geometry::SurfacePoint& point,
                 const NestedDielectrics::Crossing* crossing,
                 const Vec3& wi,
                 bool is_first) const;
    void splat(Photon& photon, const Vec2& film_point, const Rgb& radiance, float path_value) const;

    TracerContext context_;
    const World& world_;
    DirectLight direct_;
    bool has_path_layers_;
    sampling::KdWarp warp_;
    uint64_t photons_per_pass_;
};

}  // namespace velatura::integrator
