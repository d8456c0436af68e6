// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "media/henyey_greenstein.h"
#include "sampling/random_stream.h"
#include "scene/material.h"

#include <limits>

namespace velatura::media {

/// Free path in a homogeneous medium: distance to the collision, and path weights. Without a
/// sampled distance there is no collision; the transmittance is then all in the weight.
struct FreePath {
    Rgb extinction = Rgb(0.0f);  ///< sigma_t [1/scene unit]
    Rgb shares = Rgb(0.0f);      ///< probability of each channel in sampling; black: not sampled
    float end = std::numeric_limits<float>::infinity();  ///< distance to the collision [scene unit]

    bool is_drawn() const { return !is_black(shares); }

    /// Weight of a path that reaches t ≤ end without collision; t can be infinite: transmittance
    /// over the probability of reaching t.
    Rgb weight_at(float t) const;

    /// Weight of a path that collides at the end: transmittance times extinction over the density
    /// of the collision, without the albedo.
    Rgb weight_of_collision() const;
};

/// A homogeneous medium that scatters light: the interior of a closed mesh.
class HomogeneousMedium {
  public:
    /// medium.scattering must not be black.
    explicit HomogeneousMedium(const scene::MediumProperties& medium);

    const Rgb& extinction() const { return extinction_; }  ///< sigma_t [1/scene unit]

    const Rgb& albedo() const { return albedo_; }  ///< sigma_s / sigma_t

    const HenyeyGreenstein& phase() const { return phase_; }

    /// Samples the distance to a collision by one color channel, chosen in proportion to `carried`
    /// (path throughput), and weighs by all channels (balance heuristic): the weighted
    /// throughput never sums to more than before.
    /// Ref: Chiang, Kutz & Burley 2016, "Practical and Controllable Subsurface Scattering for
    ///      Production Path Tracing"; Wilkie et al. 2014, "Hero Wavelength Spectral Sampling".
    FreePath draw(const Rgb& carried, sampling::RandomStream numbers) const;

  private:
    Rgb extinction_, albedo_;
    HenyeyGreenstein phase_;
};

}  // namespace velatura::media
