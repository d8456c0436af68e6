// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "shading/albedo.h"
#include "shading/anisotropic_albedo.h"

#include <algorithm>
#include <vector>

namespace velatura::shading {

/// A rough interface between two dielectrics: microfacets (GGX) that reflect F and refract 1 − F,
/// with Schlick's F = F0 + (1 − F0)·(1 − cosθ)^5 of the cosine on the side of the smaller index,
/// and 1 under total reflection. One refraction is masked by min(G1(wo), G1(wi)): the height field
/// hides of both directions what it hides of the more grazing one. It is symmetric, keeps nearly
/// all the light that enters, and lets light pass straight as the index tends to 1.
/// Ref: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Ashikhmin,
/// Premože & Shirley 2000, "A Microfacet-based BRDF Generator" (the minimum).
///
/// What one scattering loses, m(μ) = 1 − R1(μ) − T(μ), returns as a reciprocal reflection
/// m(μo)·m(μi) / (π·m_avg) on its own side (Kulla & Conty 2017), so that R + T = 1 on both sides.
/// Both are linear in F0: m = F0·loss + (1 − F0)·excess with the loss of GGX reflection (albedo.h),
/// T = (1 − F0)·passed.
namespace rough_interface {

/// wo is on the side of the smaller index (Light) or of the larger one (Dense).
enum class Side { Light, Dense };

/// Share of one refraction that is not masked: min(1, G1(wi) / G1(wo)); both cosines > 0.
float refraction_weight(float cos_o, float cos_i, float alpha);
/// For anisotropic facets; both directions with z > 0.
float refraction_weight(const Vec3& wo, const Vec3& wi, const Vec2& alpha);

/// For F0 = 0: what refracts once, and what one scattering loses.
template <class T>
struct SharesOf {
    T passed = 0;
    T excess = 0;
};

using Shares = SharesOf<float>;

/// In double, by quadrature with `count` points of a lattice over the visible normals. mu in (0,
/// 1]. index: of the dense side over the light one, > 1.
SharesOf<double> exact_shares(double mu, double alpha, double index, Side side, int count);

/// Spreads cosines over the nodes of a table, [0, 1] → [0, 1]: dense where shares change fast,
/// towards grazing angles and around the critical one.
struct CosineAxis {
    CosineAxis() = default;
    CosineAxis(double alpha, double index, Side side);
    double position(double mu) const;
    double cosine(double position) const;

    double alpha = 1;
    double critical = -1;  ///< cosine at which total reflection begins; negative: never
    double width = 1;      ///< of the change there
    double begin = 0, scale = 1;
};

}  // namespace rough_interface

/// The shares of one index of refraction over cosine and GGX width, tabulated when made (0.01 s for
/// one width, 0.3 s for all). Absolute errors at indices 1.05 … 2.5: excess < 1.5e-3; passed <
/// 7e-3, which only weighs lobes and couples a part-opaque base.
class RoughInterface {
  public:
    /// ior: inside over outside, ≠ 1. GGX widths from alpha_low to alpha_high, each in [1e-3, 1],
    /// can be asked for; equal ones cost little.
    RoughInterface(float ior, float alpha_low, float alpha_high);
    /// Anisotropic facets of one pair of widths, whose reflection `reflected` knows; it must
    /// outlive this. Takes 0.3 s.
    RoughInterface(float ior, const Vec2& alpha, const AnisotropicAlbedo* reflected);

    float ior() const { return ior_; }

    /// Null: isotropic.
    const AnisotropicAlbedo* anisotropic() const { return anisotropic_; }

    float alpha_low() const { return alpha_low_; }

    float alpha_high() const { return alpha_high_; }

    /// The shares of one GGX width on one side.
    class Curve {
      public:
        Curve() = default;

        /// w in the frame of the widths, unit; z in [0, 1].
        rough_interface::Shares at(const Vec3& w) const {
            return anisotropic_ ? at_direction(w) : at(std::min(w.z, 1.0f));
        }

        /// Isotropic facets; mu in [0, 1].
        rough_interface::Shares at(float mu) const;

        /// Cosine-weighted means over the hemisphere: ∫ 2μ·share(μ) dμ.
        const rough_interface::Shares& average() const { return average_; }

      private:
        friend class RoughInterface;
        rough_interface::Shares at_direction(const Vec3& w) const;

        const rough_interface::Shares* low_ = nullptr;  // [node]; of anisotropic facets [row][node]
        const rough_interface::Shares* high_ = nullptr;
        float t_ = 0;
        bool is_light_ = false;
        GgxAlbedoCurve reflected_;  // on the light side, where it is known already
        rough_interface::CosineAxis axis_;
        rough_interface::Shares average_;
        const RoughInterface* anisotropic_ = nullptr;
        rough_interface::Side side_ = rough_interface::Side::Light;
    };

    /// alpha is not looked at by anisotropic facets.
    Curve curve(float alpha, rough_interface::Side side) const;

  private:
    struct Axis {
        int row = 0, next = 0;
        float t = 0;
    };

    double alpha_at(int row, int count) const;
    Axis axis_at(float alpha, int count) const;
    static rough_interface::Shares mean_of(const Curve& curve);
    rough_interface::Shares anisotropic_mean(rough_interface::Side side) const;

    const AnisotropicAlbedo* anisotropic_ = nullptr;
    AnisotropicAlbedo::Curve reflected_;  // of anisotropic facets
    Vec2 alpha_ = Vec2(1.0f);             // of anisotropic facets
    float ior_, alpha_low_, alpha_high_;
    float root_low_, root_high_;
    int row_count_, average_count_;
    std::vector<rough_interface::Shares> shares_;  // [side][row][node]; rows of anisotropic facets
                                                   // are equal steps of √α∥
    std::vector<rough_interface::Shares> averages_;  // [side][average row], finer: they divide
};

}  // namespace velatura::shading
