// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "film/film.h"
#include "integrator/caustics.h"
#include "integrator/estimator.h"
#include "integrator/guide_training.h"
#include "integrator/ray_counts.h"
#include "integrator/render_options.h"
#include "lights/light_selector.h"
#include "sampling/sampler.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::test {

/// Composes a .usda text and translates it; test failures for every diagnostic of severity error.
/// Grids of volumes are read from no file: fieldName `waves` is smoke of 20 voxels of 0.1 each way,
/// `zeros` as much of nothing.
scene::Scene scene_from_usda(const std::string& text,
                             int width = 32,
                             int height = 24,
                             bool finds_casters = false);

/// What a render may differ in without another image, whether it is guided, how its paths divide
/// and how caustics are found.
struct RenderSetup {
    int threads = 0;
    integrator::Guiding guiding = integrator::Guiding::Off;
    std::optional<film::Window> window = {};  ///< the whole image if not given
    std::vector<uint64_t> sample_splits =
        {};  ///< rendered in parts that begin here, each on its own
    integrator::Caustics caustics = integrator::Caustics::Path;
    /// Branches of every path; 0 = as many as trial paths say.
    uint32_t branches = 1;
    accel::BvhQuality bvh_quality = accel::BvhQuality::Balanced;
    scene::EffectSet forced = {};             ///< effects that run without being called for
    integrator::RayCounts* counts = nullptr;  ///< receives what was traced for the image
    lights::SelectionKind light_selection = lights::SelectionKind::Tree;
    sampling::SamplerKind sampler = sampling::SamplerKind::Sobol;
    integrator::Roulette roulette = integrator::EstimatorOptions().roulette;
};

/// Renders all light layers of a scene at its own resolution.
film::Film render_scene(const scene::Scene& scene,
                        const integrator::RenderOptions& options,
                        const RenderSetup& setup);

inline film::Film render_scene(const scene::Scene& scene,
                               const integrator::RenderOptions& options,
                               int threads = 0) {
    return render_scene(scene, options, RenderSetup{.threads = threads});
}

/// A number that differs when any bit of any sum of any pixel does.
uint64_t fingerprint(const film::Film& film);

/// The beauty, channel by channel, row by row.
std::vector<double> beauty(const film::Film& film);

/// A small room: matte floor and walls, glossy ball, metal cube, glass ball, three kinds of light
/// and a dome; 6 units wide, authored around the origin. `root_ops` are xformOp lines on the root
/// prim that holds everything, camera included.
std::string room_usda(const std::string& root_ops = "");

/// The same with lights so large and a metal so rough that there are no rare bright paths, by which
/// little could be told.
std::string soft_room();

}  // namespace velatura::test
