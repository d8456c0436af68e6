// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "media/henyey_greenstein.h"
#include "sampling/random_stream.h"
#include "scene/material.h"

#include <limits>

namespace velatura::media {

/// How far light gets in matter that is the same everywhere along its way, and what it is to be
/// weighed with there. Made without a length it has no end: all light that is lost is a weight.
struct FreeWay {
    Rgb extinction = Rgb(0.0f);  ///< [1/unit of way]
    /// Of the channels in drawing the length, with the sum 1; black: nothing was drawn.
    Rgb shares = Rgb(0.0f);
    float end = std::numeric_limits<float>::infinity();  ///< where light collides

    bool is_drawn() const { return !is_black(shares); }

    /// Of light that gets to t, which may be infinite and no further than the end: its
    /// transmittance over the probability that it does.
    Rgb weight_at(float t) const;

    /// Of light that collides at the end: transmittance times extinction over the density of doing
    /// so there. The albedo is not in it.
    Rgb weight_of_collision() const;
};

/// Matter that scatters light, the same everywhere in a body.
class BodyMedium {
  public:
    /// Its scattering is not black.
    explicit BodyMedium(const scene::Matter& matter);

    const Rgb& extinction() const { return extinction_; }  ///< [1/unit of way]

    const Rgb& albedo() const { return albedo_; }  ///< share of the extinction that scatters

    const HenyeyGreenstein& phase() const { return phase_; }

    /// Draws a length by one channel, chosen by what the path carries, and weighs by all (balance
    /// heuristic): weighed, a path never carries more in sum than it did.
    /// Ref: Chiang, Kutz & Burley 2016; Wilkie et al. 2014, "Hero Wavelength Spectral Sampling".
    FreeWay draw(const Rgb& carried, sampling::RandomStream numbers) const;

  private:
    Rgb extinction_, albedo_;
    HenyeyGreenstein phase_;
};

}  // namespace velatura::media
