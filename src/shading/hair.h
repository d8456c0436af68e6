// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/material.h"

#include <array>

namespace velatura::shading {

/// A fiber at one point: finite, in range.
struct HairParameters {
    Rgb sigma_a = Rgb(0.0f);           ///< absorption inside [1/radius]
    float roughness = 0.3f;            ///< along the fiber, in [min_hair_roughness, 1]
    float azimuthal_roughness = 0.3f;  ///< around it, the same
    float ior = 1.55f;                 ///< inside over outside, above 1
    float cuticle_angle = 0.0f;        ///< radians
};

/// Narrower lobes count as this wide.
inline constexpr float min_hair_roughness = 0.01f;

/// Absorption by concentrations of what makes hair dark and red [1/radius].
/// Ref: d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model", section 6.1.
Rgb absorption_of_melanin(const scene::Hair& hair, float eumelanin, float pheomelanin);

/// The absorption with which many fibers together look like the color, about.
/// Ref: Chiang et al. 2016, equation 9.
Rgb absorption_of_color(const Rgb& color, float azimuthal_roughness);

/// Scattering by a fiber: what it reflects (R), what passes (TT), what is reflected once inside
/// (TRT), and the rest as one lobe even around the fiber. Each lobe is normalized in both angles,
/// so that all together reflect exactly 1 where nothing is absorbed. Not reciprocal: neither the
/// tilt of the scales nor the offset across the fiber, which is where light leaves as well as where
/// it enters, is told for the two directions together.
/// Directions are unit, in the frame of the fiber: x along it from root to tip.
/// Ref: Chiang, Bitterli, Tappan & Burley 2016, "A Practical and Controllable Hair and Fur Model
/// for Production Path Tracing"; Pharr, Jakob & Humphreys 2023, section 9.9.
class HairLobes {
  public:
    static constexpr int lobe_count = 4;

    /// h: where across the fiber, from −1 to 1: the sine of the angle about x from the normal
    /// there to the direction that looks.
    HairLobes(const HairParameters& parameters, float h);

    /// What depends on the direction that looks alone.
    struct View {
        float phi = 0;                     // about x from y towards z
        float sin_theta[lobe_count] = {};  // tilted by the scales
        float cos_theta[lobe_count] = {};
        float turn[lobe_count - 1] = {};     // about x, by which the middle of a lobe is off
        Rgb attenuation[lobe_count];         // share that leaves by a lobe
        float probability[lobe_count] = {};  // of a lobe
    };

    View view(const Vec3& wo) const;

    /// f times the cosine [1/sr], pdf [1/sr].
    struct Value {
        Rgb f_cosine = Rgb(0.0f);
        float pdf = 0;
    };

    Value evaluate(const View& view, const Vec3& wi) const;

    /// Draws from the pdf of evaluate(). All numbers in [0, 1).
    Vec3 sample(const View& view, float u_lobe, const Vec2& u) const;

    /// Share of light from everywhere that is sent to where the view looks.
    static Rgb albedo(const View& view);

  private:
    void attenuate(float cos_theta, float sin_theta, View& view) const;

    Rgb sigma_a_;
    float h_, ior_;
    float gamma_o_;  // between normal and view about x
    std::array<float, lobe_count> variance_ = {}, normalizer_ = {};  // longitudinal
    float scale_ = 0, inside_ = 0;                        // of the logistic distributions
    std::array<float, 3> sin_tilt_ = {}, cos_tilt_ = {};  // of 1, 2 and 4 times the cuticle angle
};

}  // namespace velatura::shading
