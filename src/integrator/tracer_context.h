// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "guiding/guiding_field.h"
#include "integrator/caustic_paths.h"
#include "integrator/caustics.h"
#include "integrator/data_values.h"
#include "integrator/estimator.h"
#include "integrator/matte_ids.h"
#include "integrator/render_options.h"
#include "integrator/roulette_gains.h"
#include "integrator/splitting_map.h"
#include "integrator/world.h"
#include "sampling/filter.h"
#include "sampling/sampler.h"

#include <algorithm>
#include <cstdint>

namespace velatura::integrator {

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
    const SplittingMap* branches = nullptr;
    const RouletteGains* roulette =
        nullptr;  ///< of Roulette::Efficiency, must outlive the tracer; null = no trial told yet
    const MatteIds* mattes =
        nullptr;  ///< says whose each sample is, must outlive the tracer; null = nobody asks
    MatteThrough matte_through = {};
    /// Of a plate's world: only what begins with its first surface is light of the sample.
    bool is_plate = false;
    bool deep = false;  ///< says how far away each sample is, see SampleRadiance::cover
    /// What light tracing finds and camera paths skip; must outlive the tracer; null =
    /// nothing.
    const CausticPaths* caustic_paths = nullptr;
    const CausticSampler* caustics =
        nullptr;  ///< solves for caustics, must outlive the tracer; null = paths find all light
};

/// What every step of a path reads: world, options, and what follows from them and the layers.
struct TracerContext {
    TracerContext(const World& w, const film::LayerSet& layers, const PathTracerOptions& o)
        : world(w),
          options(o),
          filter(o.filter),
          has_unoccluded(layers.wants_unoccluded()),
          has_caster_layers(layers.shadow_layers && layers.caster_layers),
          has_data_layers(layers.data_layers),
          data(w, layers),
          has_emission(w.lights.has_surface_emission()),
          has_lamps(
              std::any_of(w.scene.lights.begin(),
                          w.scene.lights.end(),
                          [](const scene::Light& l) { return l.kind != scene::LightKind::Dome; })),
          depth_limit(o.max_depth > 0 ? std::min(o.max_depth, hard_depth_limit)
                                      : hard_depth_limit) {}

    /// Whether what is found now belongs to the layers by caster: the light of the first
    /// scattering.
    bool credits_casters(int bounce) const { return has_caster_layers && bounce == 1; }

    const World& world;
    PathTracerOptions options;
    sampling::PixelFilter filter;
    bool has_unoccluded, has_caster_layers, has_data_layers;
    DataValues data;    ///< named data layers
    bool has_emission;  ///< some surface emits
    bool has_lamps;     ///< Scene::lights has others than domes
    int depth_limit;
};

}  // namespace velatura::integrator
