// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/coat_lobe.h"
#include "shading/ggx_lobe.h"
#include "shading/hair_lobe.h"
#include "shading/interface_lobe.h"
#include "shading/lambert_lobe.h"
#include "shading/sheen_lobe.h"
#include "shading/surface_features.h"
#include "shading/thin_wall_lobe.h"

#include <cstdint>
#include <optional>

namespace velatura::shading {

/// The BSDF of a surface point: layered lobes, one Lambert lobe, or a fiber. Lives on the stack,
/// allocates nothing.
///
/// Space:   directions are unit vectors in render space and point away from the surface.
/// Units:   f and pdf in 1/sr; f excludes the cosine. Delta lobes are not part of f and pdf.
/// Energy:  the diffuse base and the specular lobe are coupled so that a white base reflects
///          exactly 1 (Kelemen & Szirmay-Kalos 2001, "A Microfacet Based Coupled
///          Specular-Matte BRDF Model"); the specular lobe is compensated for multiple scattering
///          (Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks").
/// Reciprocity: all lobes, except a rough reflection off the inside of an interface that transmits
///          without blur: that one conserves energy instead (README).
/// Sides:   ng decides whether a pair of directions reflects or transmits, so that no light leaks
///          through walls; lobes and the cosine use the shading normal ns(). Opaque surfaces and
///          thin walls shade both sides alike; the outside of a solid that transmits is the side
///          of ng.
class Bsdf {
  public:
    // Construction. ng, ns, wo: unit, render space; ns in the hemisphere of ng

    /// Layered surface. ns is bent towards wo when wo is behind it, and towards ng until the mirror
    /// direction of wo is above the surface.
    /// Args: horizon: normal of the smooth surface that the facets approximate, when rays start
    ///       above the facet (geometry::lifted): directions in front of it are above the surface,
    ///       too. Otherwise ng.
    Bsdf(const SurfaceParameters& parameters,
         const Vec3& ng,
         const Vec3& ns,
         const Vec3& wo,
         const Vec3& horizon);

    /// Layered surface with horizon = ng.
    Bsdf(const SurfaceParameters& parameters, const Vec3& ng, const Vec3& ns, const Vec3& wo)
        : Bsdf(parameters, ng, ns, wo, ng) {}

    /// One Lambert lobe of albedo `diffuse`: equals the first constructor with black f0 and f90.
    Bsdf(const Rgb& diffuse, const Vec3& ng, const Vec3& ns, const Vec3& wo, const Vec3& horizon);

    /// Fiber along the unit vector `along`, whose outside faces ng.
    /// Args: h: offset across the fiber, see HairLobes.
    /// Light can leave in any direction; cosine() is only the factor that f is divided by.
    Bsdf(const HairParameters& hair, float h, const Vec3& along, const Vec3& ng, const Vec3& wo);

    // Evaluation and sampling of non-delta lobes

    /// BSDF value [1/sr] without the cosine; multiply by cosine(wi).
    Rgb f(const Vec3& wo, const Vec3& wi) const { return evaluate(wo, wi).f(); }

    /// Density [1/sr] of sample_f() over all non-delta lobes.
    float pdf(const Vec3& wo, const Vec3& wi) const { return evaluate(wo, wi).pdf; }

    /// f and pdf together; fastest for the constructor's wo.
    BsdfValue evaluate(const Vec3& wo, const Vec3& wi) const;

    /// Samples a direction from the mixture of lobes.
    /// Args:    u_lobe in [0,1) selects the lobe; u in [0,1)² the direction.
    /// Returns: f and pdf of the whole mixture, or of the delta lobe (is_delta). nullopt: the
    ///          sample is absorbed (direction on the wrong side, or a black surface).
    std::optional<BsdfSample> sample_f(const Vec3& wo, float u_lobe, const Vec2& u) const;

    /// Cosine factor of f: |wi · ns|.
    float cosine(const Vec3& wi) const { return abs_dot(wi, frame_.z); }

    /// The part of a value that narrow lobes bring, see narrow_lobe_alpha; pdf, kind and eta stay.
    /// Fibers have no narrow lobes.
    BsdfValue narrow_part(const BsdfValue& value) const;

    /// value without narrow_part(value).
    BsdfValue wide_part(const BsdfValue& value) const;

    // Delta lobes

    /// Sum of the delta lobes of one kind for the constructor's wo: the expected value of what
    /// sample_f() returns from them. nullopt: there is none.
    std::optional<DeltaScattering> delta(ScatterKind kind) const;

    // Properties

    /// Shading normal, normal map applied, on the side of wo.
    const Vec3& ns() const { return frame_.z; }

    /// Hemispherical-directional reflectance plus transmittance towards wo, delta lobes included;
    /// in [0, 1].
    Rgb albedo() const;

    /// Fraction of light from the constructor's wo that reaches the diffuse base, in [0, 1].
    Rgb entering() const;

    /// True when sample_f() can select a non-delta lobe.
    bool has_non_delta() const;

    /// Probability that sampling reflects as a mirror does.
    float mirror_probability() const;

    /// Raises that probability, where it is above 0, to `probability` < 1; the other lobes share
    /// the rest as before. For wo alone; the values of f stay, densities follow.
    void raise_mirror(float probability);

    /// True for a single Lambert lobe: sample_f() ignores u_lobe.
    bool is_lambert() const { return kind_ == Kind::Lambert; }

    /// True for a fiber: ns() does not bound the directions that light arrives from.
    bool is_hair() const { return kind_ == Kind::Hair; }

    /// Probability that sample_f() selects a lobe broad enough for path guiding, in [0, 1].
    float broad_share() const;

    /// True when the index of refraction turns what is transmitted and changes nothing else: seen
    /// from the side of the smaller index, without blur.
    bool has_index_of_passage_alone() const {
        return features_.transmits() && !features_.is_dense_side() &&
               !features_.is_rough_interface();
    }

    /// True when light can leave on the side opposite to wo.
    bool has_transmission() const { return p_.opacity < 1.0f || features_.diffuse_transmission; }

  private:
    enum class Kind : uint8_t {
        Layers,
        Plain,  // layers: an opaque base with one isotropic reflection and nothing else
        Lambert,
        Hair
    };

    // plain: of Kind::Plain, known beforehand
    template <bool plain>
    static constexpr auto lobes();
    bool is_plain() const;
    template <bool plain>
    void set_layers(bool is_behind);
    void set_sides(bool is_behind);
    void set_interfaces(const Rgb& f_average, const GgxAlbedo& average);
    void set_anisotropy();
    void set_lambert();
    Vec3 shading_normal(const Vec3& ns, const Vec3& wo) const;
    bool wants_rough_transmission() const;
    template <bool plain>
    LayerView make_view(const Vec3& wo_local) const;
    template <bool plain>
    void set_probabilities(LayerView& view) const;
    Rgb interface_albedo(const Vec3& w) const;

    BsdfValue evaluate_lambert(const Vec3& wo, const Vec3& wi) const;
    BsdfValue evaluate_hair(const Vec3& wo, const Vec3& wi) const;
    template <bool plain>
    BsdfValue evaluate_layers(const Vec3& wo, const Vec3& wi) const;
    template <bool plain>
    void evaluate_local(const LayerView& view, const Vec3& wi, BsdfValue& value) const;
    void evaluate_through_sheet(const LayerView& view, const Vec3& wi, BsdfValue& value) const;
    template <bool plain>
    Rgb add_reflection(
        const LayerView& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
    void add_extras(
        const LayerView& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;

    std::optional<BsdfSample> sample_lambert(const Vec2& u) const;
    std::optional<BsdfSample> sample_hair(const Vec3& wo, float u_lobe, const Vec2& u) const;
    template <bool plain>
    std::optional<BsdfSample> sample_layers(const Vec3& wo, float u_lobe, const Vec2& u) const;
    std::optional<BsdfSample> sample_delta(const LayerView& view,
                                           LobeId lobe,
                                           const Vec3& wo) const;

    float coat_ior() const { return p_.coat_ior > 0.0f ? p_.coat_ior : p_.ior; }

    bool is_above(const Vec3& w) const { return w.dot(ng_) > 0.0f || w.dot(horizon_) > 0.0f; }

    SurfaceParameters p_;
    Frame frame_;   // z = shading normal on the side of wo
    Vec3 ng_;       // on the side of wo
    Vec3 horizon_;  // on the side of wo
    Vec3 wo_;
    float eta_ = 1;  // index beyond over index on the side of wo
    SurfaceFeatures features_;
    bool has_specular_ = true;  // f0 and f90 are not both black
    Kind kind_ = Kind::Layers;
    LambertLobe lambert_;
    Rgb specular_average_ = Rgb(0.0f);  // cosine-weighted mean of R(μ)
    LayerView view_;
    GgxLobe ggx_;
    // Seldom in use: last, so that the rest stays close together
    CoatLobe coat_;
    SheenLobe sheen_;
    ThinWallLobe thin_wall_;
    std::optional<InterfaceLobe> interface_;  // of a rough interface
    std::optional<HairLobe> fiber_;           // of Kind::Hair
};

}  // namespace velatura::shading
