// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "shading/albedo.h"
#include "shading/anisotropic_albedo.h"
#include "shading/hair.h"
#include "shading/rough_interface.h"
#include "shading/sheen.h"
#include "shading/sheet.h"

#include <cstdint>
#include <optional>

namespace velatura::shading {

/// What a scattering did, for light-path events; not which lobe the sampler happened to pick.
enum class ScatterKind : uint8_t { Reflect, Transmit };

struct BsdfSample {
    Vec3 wi;  ///< render space, unit, away from the surface
    Rgb f;  ///< [1/sr], without cosine; for a delta lobe f·cosine / pdf is the weight, with pdf a
            ///< probability
    float pdf = 0;  ///< [1/sr] over all non-delta lobes; probability for a delta lobe
    float eta = 1;  ///< η_t/η_i along the path for transmission, else 1
    bool is_delta = false;
    ScatterKind kind = ScatterKind::Reflect;
    bool is_coat = false;  ///< of a delta lobe: the coat's
};

/// What all delta lobes of one kind do together to light from the one direction they look in.
struct DeltaScattering {
    Vec3 wi;               ///< render space, unit, away from the surface
    Rgb weight;            ///< radiance towards wo over radiance from wi
    Rgb coat = Rgb(0.0f);  ///< what of `weight` the coat reflects
    float eta = 1;         ///< as in BsdfSample
};

/// f split as UsdLux's diffuse and specular multipliers need it; delta lobes are not in it.
struct BsdfValue {
    Rgb diffuse = Rgb(0.0f);   ///< [1/sr], without cosine
    Rgb specular = Rgb(0.0f);  ///< [1/sr], without cosine
    float coat = 0;            ///< what of `specular` the coat reflects
    float pdf = 0;             ///< [1/sr], what sample_f has over all non-delta lobes
    ScatterKind kind = ScatterKind::Reflect;
    float eta = 1;  ///< as in BsdfSample

    Rgb f() const { return diffuse + specular; }
};

/// A surface at one point, textures looked up: finite, in range.
struct SurfaceParameters {
    Rgb diffuse = Rgb(0.18f);  ///< albedo of the diffuse base; metallic already taken off
    Rgb f0 = Rgb(0.04f);       ///< specular reflectance at normal incidence
    Rgb f90 = Rgb(1.0f);       ///< and at grazing incidence
    float alpha = 0.25f;       ///< GGX width, roughness²
    float clearcoat = 0;       ///< weight of the coat, [0, 1]
    float clearcoat_alpha = 0;
    float opacity = 1;  ///< what is not opaque transmits (opacityMode "transparent")
    float ior = 1.5f;   ///< inside over outside
    /// Made for this ior: the roughness blurs what is transmitted, too. Null: it is refracted
    /// without blur, as the specification has it. Must outlive the Bsdf.
    const RoughInterface* interface = nullptr;

    /// Facets of two widths: `alpha` along the tangent, alpha_y across it, of the range that this
    /// was made for. Null: one width. Must outlive the Bsdf.
    const AnisotropicAlbedo* anisotropic = nullptr;
    float alpha_y = 0;
    Vec3 tangent = Vec3(0.0f);  ///< render space; zero = whatever the normal suggests

    /// A sheet without thickness, air on both sides: light passes straight, after what the two
    /// interfaces reflect to and fro.
    bool is_thin = false;
    bool is_thin_rough = false;  ///< the roughness of a sheet blurs what passes, too
    /// Of a sheet: what passes perpendicularly once; of a body: factor of each crossing.
    Rgb transmission_tint = Rgb(1.0f);
    /// Of a sheet: albedo of the base towards the other side; diffuse + this is at most 1.
    Rgb diffuse_transmitted = Rgb(0.0f);

    float diffuse_roughness = 0;  ///< of the diffuse base, [0, 1]; 0 = Lambert
    float coat_ior = 0;           ///< of the coat over what is around it; 0 = ior
    /// Fibres on top of everything, on the outside of a body. Null: none. Must outlive the Bsdf.
    const SheenAlbedo* sheen = nullptr;
    Rgb sheen_color = Rgb(0.0f);  ///< weight included
    float sheen_roughness = 1;    ///< in [SheenAlbedo::least_roughness, 1]
};

/// Below this GGX width a lobe is a perfect mirror, flagged as delta.
inline constexpr float specular_switch_alpha = 1e-3f;

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

    bool has_transmission() const { return p_.opacity < 1.0f || transmits_diffusely_; }

  private:
    enum class Kind : uint8_t {
        Layers,
        Plain,  // layers: an opaque base with one isotropic reflection and nothing else
        Lambert,
        Hair
    };

    struct Fibre {
        HairLobes lobes;
        HairLobes::View view;
    };

    enum Lobe : uint8_t {
        Cosine,
        Specular,
        Coat,
        Interface,   // rough: reflects or refracts at one microfacet, for Specular and
                     // Transmission
        Sheet,       // thin and rough: reflects at one microfacet, or the same mirrored
        CosineBack,  // to the other side of a sheet
        MirrorSpecular,
        MirrorCoat,
        Transmission,
        LobeCount
    };

    /// What depends on wo alone.
    struct View {
        Vec3 wo;                         // local
        float mu = 0;                    // wo.z
        Rgb specular = Rgb(0.0f);        // directional albedo R(μ) of the interface to the base
        Rgb reflected = Rgb(0.0f);       // that of all specular reflection; of a sheet more
        Rgb through = Rgb(0.0f);         // what transmits where nothing is opaque
        Rgb single_scatter = Rgb(0.0f);  // its share without compensation
        float loss = 0;                  // 1 − A(μ, α), what single scattering loses
        Rgb lost = Rgb(0.0f);            // of a rough interface: what returns by compensation
        float coat = 0;                  // directional albedo of the coat, weight included
        float coat_single = 0;
        float coat_loss = 0;
        float sheen = 0;                    // albedo of white sheen
        float probability[LobeCount] = {};  // of each Lobe; sums to 1 or all 0
    };

    // In bsdf_tests.h. plain: of Kind::Plain, known beforehand
    bool is_fibre() const;
    template <bool plain = false>
    bool is_thin() const;
    template <bool plain = false>
    bool transmits() const;
    template <bool plain = false>
    float opacity() const;
    template <bool plain = false>
    bool is_dense_side() const;
    template <bool plain = false>
    bool has_tint() const;
    template <bool plain = false>
    bool is_rough_interface() const;
    template <bool plain = false>
    bool is_rough_sheet() const;
    template <bool plain = false>
    bool transmits_diffusely() const;
    template <bool plain = false>
    bool is_anisotropic() const;
    template <bool plain = false>
    bool has_coat() const;
    template <bool plain = false>
    bool has_sheen() const;
    template <bool plain = false>
    bool has_rough_base() const;
    template <bool plain = false>
    bool has_extras() const;

    template <bool plain>
    static constexpr auto lobes();
    bool is_plain() const;
    template <bool plain>
    void set_layers(bool is_behind);
    void set_sides(bool is_behind);
    void set_interfaces(const Rgb& f_average, const GgxAlbedo& average);
    template <bool plain>
    View make_view(const Vec3& wo_local) const;
    template <bool plain>
    void set_probabilities(View& view) const;
    Rgb interface_albedo(const Vec3& w) const;
    template <bool plain>
    GgxAlbedo specular_albedo(const Vec3& w, float mu) const;
    void set_anisotropy();
    void set_sheet_compensation(const Rgb& f_average, float average_loss);
    Rgb passage(float cosine) const;
    void add_sheet(View& view) const;
    void set_lambert();
    BsdfValue evaluate_lambert(const Vec3& wo, const Vec3& wi) const;
    BsdfValue evaluate_hair(const Vec3& wo, const Vec3& wi) const;
    std::optional<BsdfSample> sample_hair(const Vec3& wo, float u_lobe, const Vec2& u) const;
    BsdfValue hair_value(const HairLobes::View& view, const Vec3& wo, const Vec3& wi) const;
    Vec3 shading_normal(const Vec3& ns, const Vec3& wo) const;
    bool wants_rough_transmission() const;
    void set_coat();
    Rgb rough_loss(const Vec3& w, const rough_interface::Shares& shares) const;
    Rgb microfacet_fresnel(float cos_m) const;
    float reflect_share(const Rgb& fresnel) const;
    template <bool plain>
    BsdfValue evaluate_layers(const Vec3& wo, const Vec3& wi) const;
    template <bool plain>
    std::optional<BsdfSample> sample_layers(const Vec3& wo, float u_lobe, const Vec2& u) const;
    template <bool plain>
    void evaluate_local(const View& view, const Vec3& wi, BsdfValue& value) const;
    template <bool plain>
    float facet_d(const Vec3& wm) const;
    template <bool plain>
    float facet_visibility(const View& view, const Vec3& wi, float mu_i) const;
    template <bool plain>
    float facet_pdf(const Vec3& wo, const Vec3& wm) const;
    float facet_normal_pdf(const Vec3& wo, const Vec3& wm, float cos_m) const;
    template <bool plain>
    Rgb add_reflection(
        const View& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
    Rgb add_rough_reflection(
        const View& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
    float put_under_coat(const View& view, float mu_i, BsdfValue& value) const;
    void add_coat(
        const View& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
    void add_extras(
        const View& view, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
    void add_sheen(
        const View& view, const Vec3& wi, const Vec3& wm, float mu_i, BsdfValue& value) const;

    float coat_ior() const { return p_.coat_ior > 0.0f ? p_.coat_ior : p_.ior; }

    /// What sheen of this albedo leaves to what is below.
    float under_sheen(float albedo) const { return 1.0f - max_component(p_.sheen_color) * albedo; }

    void evaluate_refraction(const View& view, const Vec3& wi, BsdfValue& value) const;
    void evaluate_through_sheet(const View& view, const Vec3& wi, BsdfValue& value) const;
    float sheet_reflect_share(float cos_m) const;
    Vec3 sample_interface(const View& view, float u_choice, const Vec2& u) const;
    Vec3 sample_sheet(const View& view, float u_choice, const Vec2& u) const;
    template <bool plain>
    Vec3 sample_facet(const Vec3& wo, const Vec2& u) const;
    std::optional<BsdfSample> sample_lambert(const Vec2& u) const;
    std::optional<BsdfSample> sample_delta(const View& view, Lobe lobe, const Vec3& wo) const;

    bool is_above(const Vec3& w) const { return w.dot(ng_) > 0.0f || w.dot(horizon_) > 0.0f; }

    SurfaceParameters p_;
    Frame frame_;   // z = shading normal on the side of wo
    Vec3 ng_;       // on the side of wo
    Vec3 horizon_;  // on the side of wo
    Vec3 wo_;
    float eta_ = 1;               // index beyond over index on the side of wo
    bool is_dense_side_ = false;  // transmitting, and wo is on the side of the larger index
    bool is_rough_interface_ = false;
    bool is_rough_sheet_ = false;
    bool transmits_diffusely_ = false;
    bool has_tint_ = false;
    bool has_coat_ = false;
    bool has_sheen_ = false;
    bool has_extras_ = false;   // coat, sheen or a rough base
    bool has_specular_ = true;  // f0 and f90 are not both black
    Kind kind_ = Kind::Layers;
    GgxAlbedoCurve specular_curve_, coat_curve_;
    bool specular_is_delta_ = false;
    bool coat_is_delta_ = false;
    float average_loss_ = 0;            // 1 − A_avg(α)
    Rgb specular_average_ = Rgb(0.0f);  // cosine-weighted mean of R(μ)
    Rgb multiple_f_ = Rgb(0.0f);        // Fresnel factor of the compensation lobe
    std::optional<RoughInterface::Curve> interface_curve_;  // of a rough interface
    Rgb lost_average_ = Rgb(0.0f);                          // cosine-weighted mean of View::lost
    float coat_f0_ = 0.04f;
    float coat_average_loss_ = 0;
    float coat_multiple_f_ = 0;
    Rgb coat_coupling_ = Rgb(1.0f);  // makes a white base under the coat reflect 1
    View view_;
    // Seldom in use: last, so that the rest stays close together
    std::optional<AnisotropicAlbedo::Curve>
        anisotropic_curve_;       // takes the place of specular_curve_
    SheetShares sheet_multiple_;  // as multiple_f_, of a rough sheet to either side
    std::optional<Fibre> fibre_;  // of Kind::Hair
};

}  // namespace velatura::shading
