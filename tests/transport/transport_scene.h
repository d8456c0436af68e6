// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "render/renderer.h"
#include "scene/scene.h"
#include "statistics/error_curve.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace velatura::test {

/// One way to estimate the light transport, as the options of `velatura render` name it.
struct Technique {
    std::string name;
    std::string instead_of;  ///< what it switches off; empty = the defaults
    std::function<void(integrator::WorldOptions&, integrator::PathTracerOptions&)> change;
    integrator::Caustics caustics = integrator::Caustics::Path;
};

/// The defaults, then each technique with one thing switched to its classic form.
const std::vector<Technique>& techniques();

/// The defaults alone.
const Technique& default_technique();

/// The scenes of scenes/transport and the Cornell box: paths below scenes/, and what to call them.
const std::vector<std::string>& transport_scenes();

/// scenes/<name>.usda, composed and translated. Ends the program when it cannot be read: the scenes
/// are the project's own.
scene::Scene load_scene(const std::string& name, int width, int height);

/// What one estimate of a whole image is: mean radiance per pixel, [height][width][3], row 0 =
/// top.
using Pixels = std::vector<double>;

/// A scene made ready for one technique.
class TransportRenderer {
  public:
    /// The scene must outlive this.
    TransportRenderer(const scene::Scene& scene, const Technique& technique);

    /// Mean of the samples [0, samples) of every pixel, in parallel over rows. Samples that are not
    /// finite or negative are left out and counted in bad_samples().
    Pixels render(uint64_t seed, uint64_t samples);

    /// What `velatura render` does by default around the technique.
    struct Placement {
        bool is_adaptive = true;
        integrator::Guiding guiding = integrator::Guiding::Auto;
        bool splits = true;
        double target_error = 0;  ///< it stops there; 0: at its samples
        /// Sees the film after every pass but the last, with what is known of its error.
        std::function<void(const film::Film&, const statistics::ErrorCurve&)> after_pass = {};
    };

    /// The same by the render schedule, `samples` in the mean where it is adaptive, after training
    /// and trials.
    Pixels render_scheduled(uint64_t seed, uint64_t samples, const Placement& placement);

    /// As that, into the layers; with halves, from two sequences.
    film::Film render_film(uint64_t seed,
                           uint64_t samples,
                           const Placement& placement,
                           const film::LayerSet& layers);

    /// The scene's light groups, and no layers but the beauty.
    film::LayerSet beauty_layers() const;

    /// Of the last of these: whether it was guided, and into how many branches its paths divided in
    /// the mean.
    bool was_guided() const { return was_guided_; }

    double mean_branches() const { return mean_branches_; }

    /// What it said of its error on the way.
    const statistics::ErrorCurve& curve() const { return curve_; }

    uint64_t bad_samples() const { return bad_; }

    const integrator::RayCounts& rays() const { return rays_; }

  private:
    const scene::Scene& scene_;
    render::Settings settings_;
    std::unique_ptr<render::Renderer> renderer_;  ///< of render(), and whose world the others share
    integrator::RayCounts rays_;
    uint64_t bad_ = 0;
    bool was_guided_ = false;
    double mean_branches_ = 1;
    statistics::ErrorCurve curve_;
};

/// Element-wise mean of estimates of one image.
Pixels mean_of(const std::vector<Pixels>& estimates);

}  // namespace velatura::test
