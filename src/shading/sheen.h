// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <array>

namespace velatura::shading {

/// f [1/sr] of a layer of fibers that stand up: the "Charlie" distribution of normals
/// (2 + 1/r)·sin^(1/r) θm / 2π over 4(μo + μi − μo·μi), unscaled.
/// Args: cosines in (0, 1]; cos_m of the half vector; roughness in [SheenAlbedo::min_roughness,
/// 1]. Ref:  Estevez & Kulla 2017, "Production Friendly Microfacet Sheen BRDF"; the denominator is
/// that
///       of Neubelt & Pettineo 2013, "Crafting a Next-Gen Material Pipeline for The Order: 1886",
///       as in MaterialX.
float sheen_f(float mu_o, float mu_i, float cos_m, float roughness);

/// Directional albedo of the sheen, tabulated when made: 0.2 s of CPU time. What the formula alone
/// would reflect above 1 (smooth fibers at grazing angles) is scaled to 1, by a factor of the
/// roughness alone, so that the lobe stays reciprocal. Error of at(): < 3e-3.
class SheenAlbedo {
  public:
    /// Below this the peak is narrower than the table.
    static constexpr float min_roughness = 0.07f;

    /// The one table, made when it is first asked for, by whichever thread.
    static const SheenAlbedo& of_process();

    /// Factor of sheen_f that keeps the energy; in (0, 1].
    float scale(float roughness) const;
    /// Albedo with that factor, in [0, 1]. mu, roughness in [0, 1].
    float at(float mu, float roughness) const;

  private:
    SheenAlbedo();

    static constexpr int cosines = 64, widths = 32;

    struct Place {
        int index = 0;
        float t = 0;
    };

    static Place width_place(float roughness);

    std::array<std::array<float, cosines>, widths> raw_;
    std::array<float, widths> scale_;
};

}  // namespace velatura::shading
