// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstddef>
#include <cstdint>

namespace velatura::shading {

/// Directional albedo of the single-scattering Smith-GGX reflection lobe with Schlick's Fresnel
/// term: F0·(1 − loss) + (F90 − F0)·schlick.
struct GgxAlbedo {
    float loss = 0;     ///< 1 − albedo for F = 1: what leaves after more than one microfacet
    float schlick = 0;  ///< albedo for F = (1 − cosθ)^5

    Rgb reflectance(const Rgb& f0, const Rgb& f90) const {
        return f0 * (1.0f - loss) + (f90 - f0) * schlick;
    }
};

/// The albedo of one lobe as a function of cosθ_o; finds the rows of the tables once.
/// alpha in [1e-3, 1]; alpha below specular_switch_alpha means a perfect mirror. Interpolated from
/// tables (tests compare them with quadrature in double): absolute errors < 6e-4 (loss) and 1e-3
/// (schlick).
class GgxAlbedoCurve {
  public:
    GgxAlbedoCurve() = default;
    explicit GgxAlbedoCurve(float alpha);

    /// mu in [0, 1].
    GgxAlbedo at(float mu) const;
    /// Cosine-weighted mean over the hemisphere: ∫ 2μ·albedo(μ) dμ.
    GgxAlbedo average() const;

  private:
    float alpha_ = 0;
    float row_t_ = 0;
    uint32_t row_ = 0;
};

/// Fresnel factor of the light that leaves after several microfacets, for the mean reflectance
/// f_average. Ref: Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks"; with
/// the geometric series' first factor F_average² (one bounce more than the single-scattering lobe
/// has).
Rgb multiple_scattering_fresnel(const Rgb& f_average, float average_loss);

namespace albedo_tables {

/// Every table has equal steps of √alpha over [root_alpha_min, 1].
inline constexpr size_t alpha_count = 32;
inline constexpr size_t average_count = 256;
inline constexpr size_t mu_count = 64;
inline constexpr float root_alpha_min = 0.0316227766f;  // α = 1e-3

/// 1 − albedo for F = 1 at equal steps of w = √(1 − √(1 − t)), t = μ·(1 + α) / (μ + α): in t the
/// drop towards grazing angles has the same width for every α, in w both of its ends are resolved.
extern const float loss[alpha_count][mu_count];
/// c / (μ + α) on the same nodes: the lobe's mean of (1 − cosθ)^5 is (1 − c)^5.
extern const float cosine[alpha_count][mu_count];
/// Means with weight 2μ of the interpolated tables; that of the loss over α².
extern const float average_loss[average_count];
extern const float average_schlick[average_count];

}  // namespace albedo_tables

}  // namespace velatura::shading
