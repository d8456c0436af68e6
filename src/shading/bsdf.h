// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/coat_lobe.h"
#include "shading/ggx_lobe.h"
#include "shading/hair_lobe.h"
#include "shading/interface_lobe.h"
#include "shading/lambert_lobe.h"
#include "shading/sheen_lobe.h"
#include "shading/surface_facts.h"
#include "shading/thin_wall_lobe.h"

#include <cstdint>
#include <optional>

namespace velatura::shading {

/// The scattering function of a surface point; lives on the stack, allocates nothing.
///
/// Energy: diffuse base and specular are coupled so that white bases reflect exactly 1 (Kelemen &
/// Szirmay-Kalos 2001); the specular lobe is compensated for multiple scattering (Kulla & Conty
/// 2017). Everything is reciprocal except a rough reflection off the inside of an interface that
/// transmits without blur, which keeps energy instead (README). Sides: ng decides whether a pair of
/// directions reflects or transmits, so that no light leaks through walls; lobes and the cosine use
/// the shading normal `ns()`. Opaque surfaces and thin sheets shade both sides alike; the outside
/// of a body that transmits is the side of ng.
class Bsdf {
  public:
    /// ng, ns, wo: unit, render space; ns in the hemisphere of ng. ns is bent towards wo when wo is
    /// behind it, and so far towards ng that the mirror image of wo stays above the surface.
    /// horizon: normal of the smooth surface that facets stand for, when rays start above the facet
    /// (geometry::lifted): what is in front of it is above the surface, too. Else ng.
    Bsdf(const SurfaceParameters& parameters,
         const Vec3& ng,
         const Vec3& ns,
         const Vec3& wo,
         const Vec3& horizon);

    Bsdf(const SurfaceParameters& parameters, const Vec3& ng, const Vec3& ns, const Vec3& wo)
        : Bsdf(parameters, ng, ns, wo, ng) {}

    /// One diffuse lobe and nothing else, of this albedo: what the first constructor makes of black
    /// f0 and f90.
    Bsdf(const Rgb& diffuse, const Vec3& ng, const Vec3& ns, const Vec3& wo, const Vec3& horizon);

    /// A fibre along the unit vector `along`, where its outside faces ng (render space, as above);
    /// h: see HairLobes. Light may go anywhere, and cosine() is no more than a factor that f is
    /// divided by.
    Bsdf(const HairParameters& hair, float h, const Vec3& along, const Vec3& ng, const Vec3& wo);

    /// f [1/sr] without the cosine and without delta lobes. The cosine to multiply with is
    /// cosine(wi).
    Rgb f(const Vec3& wo, const Vec3& wi) const { return evaluate(wo, wi).f(); }

    float pdf(const Vec3& wo, const Vec3& wi) const { return evaluate(wo, wi).pdf; }

    /// f and pdf together; fastest when wo is the one given to the constructor.
    BsdfValue evaluate(const Vec3& wo, const Vec3& wi) const;
    /// Samples one lobe of the mixture; f and pdf are those of the whole mixture unless is_delta.
    /// nullopt: the sample is absorbed (direction on the wrong side, or a black surface).
    std::optional<BsdfSample> sample_f(const Vec3& wo, float u_lobe, const Vec2& u) const;

    /// The delta lobes that reflect, or the one that transmits, seen from the constructor's wo:
    /// what sample_f brings in the mean when it draws them. nullopt: there is none.
    std::optional<DeltaScattering> delta(ScatterKind kind) const;

    /// The cosine that belongs to f: |wi · ns|.
    float cosine(const Vec3& wi) const { return abs_dot(wi, frame_.z); }

    /// Normal used for shading, normal map applied, on the side of wo.
    const Vec3& ns() const { return frame_.z; }

    /// Share of light from everywhere that is sent towards wo, delta lobes and transmission
    /// included; in [0, 1].
    Rgb albedo() const;
    /// Share of light from the constructor's wo that gets to the diffuse base.
    Rgb entering() const;

    bool has_non_delta() const;

    /// One diffuse lobe and nothing else: sample_f does not look at u_lobe.
    bool is_lambert() const { return kind_ == Kind::Lambert; }

    /// A fibre: ns() says nothing about where light comes from.
    bool is_hair() const { return kind_ == Kind::Hair; }

    /// Probability that sample_f draws from a lobe as broad as learned directions can resolve.
    float broad_share() const;

    bool has_transmission() const { return p_.opacity < 1.0f || facts_.diffuse_transmission; }

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
    SurfaceFacts facts_;
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
    std::optional<HairLobe> fibre_;           // of Kind::Hair
};

}  // namespace velatura::shading
