// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/interior.h"
#include "integrator/ray_counts.h"
#include "integrator/specular_casters.h"
#include "integrator/specular_chain.h"
#include "integrator/world.h"
#include "lights/emitter.h"
#include "sampling/sampler.h"
#include "shading/bsdf.h"

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace velatura::integrator {

/// How light that comes by perfect mirrors and smooth interfaces is found.
enum class Caustics : uint8_t {
    Path,         ///< by path tracing alone
    Manifold,     ///< by solving for the chain that joins a vertex and a point of the light
    SmallLights,  ///< Manifold for lights so small that paths seldom meet them, Path for the others
    Light,        ///< by light tracing, see LightTracer
    Auto,         ///< Light where trial paths predict a gain, Path elsewhere
};

/// "path", "manifold", "small-lights", "light", "auto".
std::optional<Caustics> caustics_mode(std::string_view name);

/// What a path did since it last scattered by a lobe that is no delta.
struct SpecularHistory {
    int length = 0;           ///< delta scatterings
    bool is_handled = false;  ///< CausticSampler finds such chains
};

/// Solves for caustics: joins a vertex and a point of a light by a chain of perfect reflections and
/// refractions. Which chains these are is exactly what finds() says of a path that goes the other
/// way: paths leave out the light that they meet there, and all else stays theirs.
///
/// A chain is one of 1 to longest_specular_chain delta scatterings at plain vertices
/// (is_plain_vertex), with no cut-out or index-1 surface passed, that starts at a vertex with a
/// lobe that is no delta and ends at a light of the scene that is no dome. Emissive meshes, domes,
/// normal-mapped mirrors and what rough lobes pass on are left to the paths.
///
/// A point of the light is drawn, then a chain is sought from a random ray towards a shape that
/// reflects or refracts: the events of that ray are kept, its direction is improved by Newton's
/// method until the chain ends at the point. How likely that was is estimated without bias by the
/// number of further rays until the same solution is found again. Every number is a function of the
/// pixel sampler's. Immutable, safe to share among threads; the world must outlive it.
/// Ref: Zeltner, Georgiev & Jakob 2020, "Specular Manifold Sampling for Rendering High-Frequency
/// Caustics and Glints", sections 3 and 4; Hanika, Droske & Fascione 2015, "Manifold Next Event
/// Estimation".
class CausticSampler {
  public:
    /// Further rays that are tried before a solution's probability counts as 1 / trial_cap.
    static constexpr uint32_t trial_cap = 1u << 16;

    /// Lights of about twice this half angle (radians, SpecularCasters::half_angle_of) are as well
    /// met by chance (docs/adr/0010): what Caustics::SmallLights leaves to paths.
    static constexpr double auto_largest_light = 1.0 / 32.0;

    /// largest_light: half angle beyond which a light is left to the paths.
    explicit CausticSampler(const World& world,
                            double largest_light = std::numeric_limits<double>::infinity());

    /// Nothing casts caustics, or no light could: sampling finds nothing and finds() is false.
    bool is_empty() const { return casters_.is_empty() || lights_.empty(); }

    /// The history after scattering. passed: surfaces that the segment before went straight
    /// through.
    SpecularHistory after(const SpecularHistory& before,
                          const geometry::SurfacePoint& point,
                          const shading::Bsdf& bsdf,
                          bool is_delta,
                          uint32_t passed) const;

    /// Whether light met by a path of this history is what sample() brings. passed: as above, of
    /// the segment that meets it.
    bool finds(const SpecularHistory& history, uint32_t light, uint32_t passed) const {
        return history.is_handled && history.length > 0 && passed == 0 && is_handled_[light];
    }

    /// A vertex to find light for.
    struct Receiver {
        const geometry::SurfacePoint& point;
        const shading::Bsdf& bsdf;
        Vec3 wo;
        lights::RayCone cone;
        const Interior& interior;  ///< on the side of wo
    };

    struct Estimate {
        Rgb radiance;           ///< estimate of what leaves the vertex towards wo
        Vec3 wi;                ///< from where it arrives at the vertex
        SpecularEvents events;  ///< delta scatterings between vertex and light
        std::array<Rgb, longest_specular_chain> coats =
            {};  ///< of each, the share that a coat reflects
        uint32_t light = 0;
    };

    /// One estimate of all the light that arrives by such chains. bounce, repeat: see PixelSampler.
    std::optional<Estimate> sample(const Receiver& receiver,
                                   const sampling::PixelSampler& sampler,
                                   int bounce,
                                   uint32_t repeat,
                                   RayCounts& counts) const;

  private:
    /// What the chain must end at.
    struct Target {
        uint32_t light = 0;
        bool is_infinite = false;
        double pmf = 0;  ///< of the light
        lights::EmitterPoint point;
    };

    /// A first direction with the chain that it leads to.
    struct Solution {
        SpecularEvents events;
        Vec3d d = Vec3d(0.0);
        SpecularChain chain;
        std::array<Rgb, longest_specular_chain> coats =
            {};               ///< of each event, what a coat reflects
        double distance = 0;  ///< from the last surface to the light
        double density = 0;   ///< solid angle at the vertex over the area across the ray at the
                              ///< light, or over the solid angle at infinity
    };

    struct Search;
    struct Aim;

    void add_lights(double largest_light);
    Target choose_target(const Search& search) const;
    Vec3d seed_direction(const Search& search, uint32_t trial) const;
    bool find_events(const Search& search,
                     uint32_t trial,
                     const Vec3& d,
                     const SpecularEvents* wanted,
                     SpecularEvents& events) const;
    bool try_seed(const Search& search,
                  uint32_t trial,
                  const SpecularEvents* wanted,
                  Solution& out) const;
    bool aim(const Search& search, const Vec3d& d, Solution& out, Aim& aim) const;
    bool solve(const Search& search, const Vec3d& seed, Solution& out) const;
    Rgb contribution(const Search& search, Solution& solution) const;
    Rgb visibility(const Search& search,
                   const Solution& solution,
                   const geometry::SurfacePoint& last,
                   const Interior& interior,
                   const lights::RayCone& cone) const;

    Rgb through_volumes(
        const Search& search, const Vec3& o, const Vec3& d, float distance, int segment) const;

    const World& world_;
    SpecularCasters casters_;
    std::vector<uint8_t> is_handled_;           // [light of the scene]
    std::vector<uint32_t> lights_;              // those that are
    std::vector<double> light_cdf_;             // [lights_] share of the power up to each
    std::vector<std::optional<Vec3d>> facing_;  // [lights_] direction towards all casters
};

/// The sampler that the mode asks for; null for Caustics::Path.
std::unique_ptr<const CausticSampler> make_caustic_sampler(Caustics mode, const World& world);

}  // namespace velatura::integrator
