// SPDX-License-Identifier: Apache-2.0
#include "shading/bsdf.h"

#include "sampling/warp.h"
#include "shading/bsdf_tests.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/rgb_math.h"
#include "shading/sheet.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::shading {

namespace {

/// How far the albedo of Schlick's lobe (albedo.h) spreads over the cosines, as a standard
/// deviation against that of a mirror. Fit to the tables, within 0.02.
float schlick_spread(float alpha) {
    return 1.0f / (1.0f + 23.0f * alpha * std::sqrt(alpha));
}

/// Bends ns towards wo until wo is clearly in front of it; both are unit and on the same side of
/// the surface. ng is on the side of wo.
Vec3 bent_normal(const Vec3& ns, const Vec3& ng, const Vec3& wo) {
    constexpr float least = 1e-3f;  // cosine between ns and wo
    const float facing = ns.dot(wo);
    if (facing >= least) return ns;
    // The geometric normal faces wo by definition: walk towards it just as far as needed
    const float front = ng.dot(wo);
    if (front <= least) return ng;
    const float t = (least - facing) / (front - facing);
    const Vec3 bent = ns + (ng - ns) * t;
    const float length2 = bent.dot(bent);
    return length2 > 1e-6f ? bent / std::sqrt(length2) : ng;
}

/// Turns ns just as far as the mirror image of wo about it has to rise to stay above the surface,
/// so that no reflection is lost to a normal map. ng and ns face wo. Ref: Keller et al. 2017, "The
/// Iray Light Transport Simulation and Rendering System", appendix A.3, "Local Shading Normal
/// Adaption".
Vec3 reflecting_normal(const Vec3& ns, const Vec3& ng, const Vec3& horizon, const Vec3& wo) {
    const Vec3 mirrored = ns * (2.0f * ns.dot(wo)) - wo;
    // An undisturbed normal always passes, also at grazing angles
    const float least = std::min(0.9f * ng.dot(wo), 1e-2f);
    const float height = mirrored.dot(ng);
    if (height >= least || mirrored.dot(horizon) >= least) return ns;
    const Vec3 along = mirrored - ng * height;
    const float length2 = along.dot(along);
    if (!(length2 > 0.0f && least > 0.0f)) return ng;
    const Vec3 raised = along * std::sqrt((1.0f - least * least) / length2) + ng * least;
    return normalize(wo + raised);
}

}  // namespace

Bsdf::Bsdf(const SurfaceParameters& parameters,
           const Vec3& ng,
           const Vec3& ns,
           const Vec3& wo,
           const Vec3& horizon)
    : p_(parameters), wo_(wo) {
    const bool is_behind = ng.dot(wo) < 0.0f;
    ng_ = is_behind ? -ng : ng;
    horizon_ = is_behind ? -horizon : horizon;
    has_specular_ = !(is_black(p_.f0) && is_black(p_.f90));
    frame_ = Frame::from_z(ns == ng ? ng_ : shading_normal(is_behind ? -ns : ns, wo));
    if (is_plain()) {
        kind_ = Kind::Plain;
        set_layers<true>(is_behind);
    } else {
        set_layers<false>(is_behind);
    }
}

/// Whether nothing but a base and its reflection is asked for.
bool Bsdf::is_plain() const {
    return !transmits() && !is_thin() && !has_rough_base() && !p_.anisotropic && !p_.sheen &&
           !(p_.clearcoat > 0.0f);
}

/// Everything but normals.
template <bool plain>
void Bsdf::set_layers(bool is_behind) {
    specular_is_delta_ = !has_specular_ || p_.alpha < specular_switch_alpha;
    if (!plain) set_sides(is_behind);
    if (!has_specular_ && !has_extras<plain>() && opacity<plain>() == 1.0f &&
        !transmits_diffusely<plain>()) {
        set_lambert();
        return;
    }
    GgxAlbedo average;
    if (!plain && p_.anisotropic && !specular_is_delta_) {
        set_anisotropy();
        average = anisotropic_curve_->average();
    } else {
        specular_curve_ = GgxAlbedoCurve(has_specular_ ? p_.alpha : 0.0f);
        average = specular_curve_.average();
    }
    average_loss_ = average.loss;
    const Rgb f_average = p_.f0 + (p_.f90 - p_.f0) * (1.0f / 21.0f);
    multiple_f_ = multiple_scattering_fresnel(f_average, average.loss);
    specular_average_ = average.reflectance(p_.f0, p_.f90) + multiple_f_ * average.loss;
    if (!plain) set_interfaces(f_average, average);
    view_ = make_view<plain>(frame_.to_local(wo_));
}

/// What is on the side of wo, and what lies beyond.
void Bsdf::set_sides(bool is_behind) {
    if (transmits() && !is_thin()) {
        eta_ = is_behind ? 1.0f / p_.ior : p_.ior;
        is_dense_side_ = eta_ < 1.0f;
    }
    has_tint_ = transmits() && p_.transmission_tint != Rgb(1.0f);
    // The coat lies on the outside, on both sides of a sheet; index 1 has no interface
    const bool is_outside = !(transmits() && is_behind && !is_thin());
    has_coat_ = p_.clearcoat > 0.0f && coat_ior() != 1.0f && is_outside;
    has_sheen_ = p_.sheen != nullptr && is_outside;
    has_extras_ = has_coat() || has_sheen() || has_rough_base();
    transmits_diffusely_ = is_thin() && opacity() > 0.0f && !is_black(p_.diffuse_transmitted);
    coat_is_delta_ = p_.clearcoat_alpha < specular_switch_alpha;
}

/// Interfaces that blur what they transmit, seen from the dense side, or under a coat.
void Bsdf::set_interfaces(const Rgb& f_average, const GgxAlbedo& average) {
    is_rough_interface_ = wants_rough_transmission();
    is_rough_sheet_ =
        is_thin() && transmits() && p_.is_thin_rough && !specular_is_delta_ && p_.ior != 1.0f;
    if (is_rough_sheet()) set_sheet_compensation(f_average, average.loss);
    if (is_rough_interface()) {
        p_.f90 = Rgb(1.0f);
        interface_curve_ =
            p_.interface->curve(p_.alpha, is_dense_side() ? rough_interface::Side::Dense
                                                          : rough_interface::Side::Light);
        const rough_interface::Shares& shares = interface_curve_->average();
        lost_average_ = p_.f0 * average.loss + one_minus(p_.f0) * shares.excess;
        specular_average_ = one_minus(one_minus(p_.f0) * shares.passed);
    } else if (is_dense_side()) {
        // Seen from the dense side, 1 − R_avg shrinks by η² (1 − F_in = (1 − F_out)/η²)
        specular_average_ = one_minus(one_minus(specular_average_) * (eta_ * eta_));
    }
    if (has_coat()) set_coat();
}

Bsdf::Bsdf(const Rgb& diffuse, const Vec3& ng, const Vec3& ns, const Vec3& wo, const Vec3& horizon)
    : wo_(wo), has_specular_(false) {
    p_.diffuse = diffuse;
    const bool is_behind = ng.dot(wo) < 0.0f;
    ng_ = is_behind ? -ng : ng;
    horizon_ = is_behind ? -horizon : horizon;
    frame_ = Frame::from_z(ns == ng ? ng_ : shading_normal(is_behind ? -ns : ns, wo));
    set_lambert();
}

void Bsdf::set_lambert() {
    kind_ = Kind::Lambert;
    view_.wo = frame_.to_local(wo_);
    view_.probability[Cosine] = is_black(p_.diffuse) ? 0.0f : 1.0f;
}

/// ns, in the hemisphere of ng and on the side of wo, bent as far as wo and reflection ask for.
Vec3 Bsdf::shading_normal(const Vec3& ns, const Vec3& wo) const {
    const Vec3 bent = bent_normal(bent_normal(ns, ng_, ng_), ng_, wo);
    if (!has_specular_ && !(p_.clearcoat > 0.0f)) return bent;
    return reflecting_normal(bent, ng_, horizon_, wo);
}

/// Blurred refraction, unless it turns directions by less than what counts as a mirror's blur.
bool Bsdf::wants_rough_transmission() const {
    if (p_.interface == nullptr || !transmits() || specular_is_delta_) return false;
    if (is_thin()) return false;
    const float turn = p_.alpha * std::abs(1.0f - eta_) / std::max(eta_, 1.0f);
    return turn >= specular_switch_alpha;
}

/// Light that leaves a rough sheet after several microfacets: each sends on what it neither absorbs
/// nor lets out; to which side, as one microfacet does in the mean.
void Bsdf::set_sheet_compensation(const Rgb& f_average, float average_loss) {
    // Of a diffuse field
    constexpr float mean_cosine = 2.0f / 3.0f;
    const SheetShares once = sheet_shares(f_average, passage(mean_cosine));
    const Rgb kept = once.reflected + once.transmitted;
    const Rgb factor = safe_divide(multiple_scattering_fresnel(kept, average_loss), kept);
    sheet_multiple_ = {once.reflected * factor, once.transmitted * factor};
}

/// Turns the frame about the normal to where the tangent points.
void Bsdf::set_anisotropy() {
    anisotropic_curve_ = p_.anisotropic->curve({p_.alpha, p_.alpha_y});
    const Vec3 along = p_.tangent - frame_.z * frame_.z.dot(p_.tangent);
    const float length2 = along.dot(along);
    if (!(length2 > 1e-12f)) return;
    frame_.x = along / std::sqrt(length2);
    frame_.y = cross(frame_.z, frame_.x);
}

void Bsdf::set_coat() {
    const float r = (1.0f - coat_ior()) / (1.0f + coat_ior());
    coat_f0_ = r * r;
    coat_curve_ = GgxAlbedoCurve(p_.clearcoat_alpha);
    const GgxAlbedo coat = coat_curve_.average();
    coat_average_loss_ = coat.loss;
    coat_multiple_f_ =
        multiple_scattering_fresnel(Rgb(coat_f0_ + (1.0f - coat_f0_) * (1.0f / 21.0f)), coat.loss)
            .x;
    if ((is_black(p_.diffuse) && !transmits_diffusely()) || !(opacity() > 0.0f)) return;
    // The base receives (1 − C)(1 − R) of both directions, over the mean of that product: the
    // product of the means and the covariance of the two Schlick terms, 1/66 − 1/441 for mirrors
    const float coat_average = p_.clearcoat * (coat.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x +
                                               coat_multiple_f_ * coat.loss);
    const float covariance =
        p_.clearcoat * (1.0f - coat_f0_) * (1.0f / 66.0f - 1.0f / 441.0f) *
        schlick_spread(p_.clearcoat_alpha) *
        schlick_spread(is_anisotropic() ? std::sqrt(p_.alpha * p_.alpha_y) : p_.alpha);
    const Rgb under_base = one_minus(specular_average_);
    coat_coupling_ =
        safe_divide(under_base, under_base * (1.0f - coat_average) + (p_.f90 - p_.f0) * covariance);
}

template <bool plain>
GgxAlbedo Bsdf::specular_albedo(const Vec3& w, float mu) const {
    return is_anisotropic<plain>() ? anisotropic_curve_->at(w) : specular_curve_.at(mu);
}

/// What single scattering at a rough interface loses, and compensation returns.
Rgb Bsdf::rough_loss(const Vec3& w, const rough_interface::Shares& shares) const {
    return p_.f0 * specular_albedo<false>(w, w.z).loss + one_minus(p_.f0) * shares.excess;
}

/// Directional albedo R(μ) of the base's specular reflection. Transmission across the interface is
/// 1 − R(μ), equal for the two directions of a refracted pair: both ask for the cosine on the side
/// of the smaller index.
Rgb Bsdf::interface_albedo(const Vec3& w) const {
    Vec3 outer = w;
    if (is_dense_side()) {
        const float cosine = refracted_cosine(w.z, eta_);
        if (cosine < 0.0f) return Rgb(1.0f);
        outer = Vec3(w.x / eta_, w.y / eta_, cosine);
    }
    const GgxAlbedo a = specular_albedo<false>(outer, outer.z);
    return a.reflectance(p_.f0, p_.f90) + multiple_f_ * a.loss;
}

template <bool plain>
Bsdf::View Bsdf::make_view(const Vec3& wo_local) const {
    View v;
    v.wo = wo_local;
    v.mu = std::clamp(wo_local.z, 0.0f, 1.0f);
    const Vec3 clamped(wo_local.x, wo_local.y, v.mu);
    if (is_rough_interface<plain>()) {
        const rough_interface::Shares shares = interface_curve_->at(clamped);
        v.lost = rough_loss(clamped, shares);
        v.specular = one_minus(one_minus(p_.f0) * shares.passed);
        v.single_scatter = v.specular - v.lost;
    } else {
        const GgxAlbedo a = specular_albedo<plain>(clamped, v.mu);
        v.loss = a.loss;
        v.specular = is_dense_side<plain>() ? interface_albedo(clamped)
                                            : a.reflectance(p_.f0, p_.f90) + multiple_f_ * a.loss;
        v.single_scatter =
            is_dense_side<plain>() ? v.specular * (1.0f - a.loss) : a.reflectance(p_.f0, p_.f90);
    }
    v.reflected = v.specular;
    v.through = one_minus(v.specular);
    if (is_thin<plain>() && transmits<plain>()) {
        add_sheet(v);
    } else if (has_tint<plain>()) {
        v.through = v.through * p_.transmission_tint;
    }
    if (has_coat<plain>()) {
        const GgxAlbedo c = coat_curve_.at(v.mu);
        v.coat_loss = c.loss;
        v.coat_single = p_.clearcoat * c.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x;
        v.coat = v.coat_single + p_.clearcoat * coat_multiple_f_ * c.loss;
    }
    if (has_sheen<plain>()) v.sheen = p_.sheen->at(v.mu, p_.sheen_roughness);
    set_probabilities<plain>(v);
    return v;
}

/// What survives one passage between the interfaces of a sheet: the tint is that of the
/// perpendicular one, and slanted ones are longer.
Rgb Bsdf::passage(float cosine) const {
    if (!has_tint()) return Rgb(1.0f);
    const float inside = refracted_cosine(cosine, p_.ior);
    if (!(inside > 0.0f)) return Rgb(0.0f);
    const Rgb& t = p_.transmission_tint;
    return {std::pow(t.x, 1.0f / inside), std::pow(t.y, 1.0f / inside),
            std::pow(t.z, 1.0f / inside)};
}

/// The second interface of a sheet, behind that part of the first which does not end at the base.
void Bsdf::add_sheet(View& v) const {
    const SheetShares shares = sheet_shares(v.specular, passage(v.mu));
    v.reflected = v.specular + (shares.reflected - v.specular) * (1.0f - opacity());
    v.through = shares.transmitted;
    v.single_scatter = v.reflected * (1.0f - v.loss);
}

/// Picks lobes in proportion to what each sends towards wo.
template <bool plain>
void Bsdf::set_probabilities(View& v) const {
    const float under_coat = 1.0f - v.coat;
    const Rgb passed = one_minus(v.specular);
    float weight[LobeCount] = {};
    const float reflected = under_coat * mean(v.single_scatter);
    const float transmitted = under_coat * (1.0f - opacity<plain>()) * mean(v.through);
    if (is_rough_interface<plain>()) {
        weight[Interface] = reflected + transmitted;
    } else if (is_rough_sheet<plain>()) {
        weight[Sheet] = reflected + transmitted * (1.0f - v.loss);
        weight[CosineBack] = transmitted * v.loss;
    } else {
        weight[specular_is_delta_ ? MirrorSpecular : Specular] = reflected;
        weight[Transmission] = transmitted;
    }
    weight[Cosine] = under_coat * (opacity<plain>() * mean(p_.diffuse * passed) +
                                   mean(v.reflected - v.single_scatter)) +
                     (v.coat - v.coat_single);
    if (transmits_diffusely<plain>())
        weight[CosineBack] += under_coat * opacity<plain>() * mean(p_.diffuse_transmitted * passed);
    if (has_coat<plain>()) weight[coat_is_delta_ ? MirrorCoat : Coat] = v.coat_single;
    if (has_sheen<plain>()) {
        for (float& w : weight) w *= under_sheen(v.sheen);
        weight[Cosine] += mean(p_.sheen_color) * v.sheen;
    }
    float sum = 0;
    for (const Lobe i : lobes<plain>()) {
        weight[i] = std::max(weight[i], 0.0f);
        sum += weight[i];
    }
    if (!(sum > 0.0f)) return;
    for (const Lobe i : lobes<plain>()) {
        // Most lobes are not there, and need no division
        if (weight[i] > 0.0f) v.probability[i] = weight[i] / sum;
    }
}

std::optional<BsdfSample> Bsdf::sample_delta(const View& v, Lobe lobe, const Vec3& wo) const {
    BsdfSample s;
    s.is_delta = true;
    s.pdf = v.probability[lobe];
    const float under_coat = 1.0f - v.coat;
    Rgb weight;
    if (lobe == Transmission) {
        const float cos_t = refracted_cosine(v.mu, eta_);
        if (cos_t <= 0.0f) return std::nullopt;
        s.wi = frame_.from_local(Vec3(-v.wo.x / eta_, -v.wo.y / eta_, -cos_t));
        if (eta_ == 1.0f) s.wi = -wo;
        if (!(s.wi.dot(ng_) < 0.0f)) return std::nullopt;
        s.kind = ScatterKind::Transmit;
        s.eta = eta_;
        // Radiance is compressed into a smaller cone by η² on entering; (1/η²) is the price
        weight = v.through * ((1.0f - opacity()) * under_coat / (eta_ * eta_));
    } else {
        s.wi = frame_.from_local(Vec3(-v.wo.x, -v.wo.y, v.wo.z));
        if (!is_above(s.wi)) return std::nullopt;
        s.is_coat = lobe == MirrorCoat;
        weight = lobe == MirrorSpecular ? v.reflected * under_coat : Rgb(v.coat);
    }
    if (has_sheen()) weight *= under_sheen(v.sheen);
    const float length2 = s.wi.dot(s.wi);
    s.wi /= std::sqrt(length2);
    const float cos_i = cosine(s.wi);
    if (!(cos_i > 0.0f)) return std::nullopt;
    s.f = weight / cos_i;
    return s;
}

std::optional<DeltaScattering> Bsdf::delta(ScatterKind kind) const {
    if (!(view_.wo.z > 0.0f) || !(wo_.dot(ng_) > 0.0f)) return std::nullopt;
    std::optional<DeltaScattering> out;
    for (const Lobe lobe : {MirrorSpecular, MirrorCoat, Transmission}) {
        if ((lobe == Transmission) != (kind == ScatterKind::Transmit)) continue;
        if (!(view_.probability[lobe] > 0.0f)) continue;
        const std::optional<BsdfSample> sample = sample_delta(view_, lobe, wo_);
        if (!sample) continue;
        if (!out) out = DeltaScattering{sample->wi, Rgb(0.0f), Rgb(0.0f), sample->eta};
        const Rgb weight = sample->f * cosine(sample->wi);
        out->weight += weight;
        if (sample->is_coat) out->coat += weight;
    }
    return out;
}

/// Draws a visible microfacet and lets it reflect or refract. Zero vector: nothing.
Vec3 Bsdf::sample_interface(const View& v, float u_choice, const Vec2& u) const {
    const Vec3 wm = is_anisotropic() ? ggx_sample_normal(v.wo, Vec2(p_.alpha, p_.alpha_y), u)
                                     : ggx_sample_normal(v.wo, p_.alpha, u);
    const float cos_m = std::min(v.wo.dot(wm), 1.0f);
    if (!(cos_m > 0.0f)) return Vec3(0.0f);
    if (u_choice < reflect_share(microfacet_fresnel(cos_m))) {
        const Vec3 wi = wm * (2.0f * cos_m) - v.wo;
        return wi.z > 0.0f ? wi : Vec3(0.0f);
    }
    const float cos_t = refracted_cosine(cos_m, eta_);
    if (!(cos_t > 0.0f)) return Vec3(0.0f);
    const Vec3 wi = wm * (cos_m / eta_ - cos_t) - v.wo / eta_;
    return wi.z < 0.0f ? wi : Vec3(0.0f);
}

/// Draws a reflection and keeps it, or takes its mirror image on the other side.
Vec3 Bsdf::sample_sheet(const View& v, float u_choice, const Vec2& u) const {
    Vec3 wi = sample_facet<false>(v.wo, u);
    if (!(wi.z > 0.0f)) return Vec3(0.0f);
    const Vec3 across = v.wo + wi;
    const float cos_m = std::min(0.5f * std::sqrt(across.dot(across)), 1.0f);
    if (!(u_choice < sheet_reflect_share(cos_m))) wi.z = -wi.z;
    return wi;
}

template <bool plain>
Vec3 Bsdf::sample_facet(const Vec3& wo, const Vec2& u) const {
    return is_anisotropic<plain>() ? ggx_sample(wo, Vec2(p_.alpha, p_.alpha_y), u)
                                   : ggx_sample(wo, p_.alpha, u);
}

std::optional<BsdfSample> Bsdf::sample_lambert(const Vec2& u) const {
    const Vec3 wi = sampling::cosine_hemisphere(u);
    if (is_black(p_.diffuse) || !(wi.z > 0.0f)) return std::nullopt;
    BsdfSample s;
    s.wi = renormalize(frame_.from_local(wi));
    if (!is_above(s.wi)) return std::nullopt;
    s.f = p_.diffuse * inv_pi;
    s.pdf = sampling::cosine_hemisphere_pdf(wi.z);
    return s;
}

std::optional<BsdfSample> Bsdf::sample_f(const Vec3& wo, float u_lobe, const Vec2& u) const {
    if (kind_ == Kind::Plain) return sample_layers<true>(wo, u_lobe, u);
    if (kind_ == Kind::Layers) return sample_layers<false>(wo, u_lobe, u);
    if (is_fibre()) return sample_hair(wo, u_lobe, u);
    if (!(wo.dot(frame_.z) > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;
    return sample_lambert(u);
}

template <bool plain>
std::optional<BsdfSample> Bsdf::sample_layers(const Vec3& wo, float u_lobe, const Vec2& u) const {
    std::optional<View> other;
    if (wo != wo_) other = make_view<plain>(frame_.to_local(wo));
    const View& v = other ? *other : view_;
    if (!(v.wo.z > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;

    // Pick a lobe; rounding of the sum falls to the last one that has a share
    int lobe = -1;
    for (const Lobe i : lobes<plain>()) {
        if (!(v.probability[i] > 0.0f)) continue;
        lobe = i;
        if (u_lobe < v.probability[i]) break;
        u_lobe -= v.probability[i];
    }
    if (lobe < 0) return std::nullopt;

    Vec3 wi;
    switch (lobe) {
        case Cosine:
            wi = sampling::cosine_hemisphere(u);
            break;
        case Specular:
            wi = sample_facet<plain>(v.wo, u);
            break;
        case Coat:
            wi = ggx_sample(v.wo, p_.clearcoat_alpha, u);
            break;
        case Interface:
            wi = sample_interface(v, std::min(u_lobe / v.probability[Interface], 1.0f), u);
            break;
        case Sheet:
            wi = sample_sheet(v, std::min(u_lobe / v.probability[Sheet], 1.0f), u);
            break;
        case CosineBack:
            wi = sampling::cosine_hemisphere(u);
            wi.z = -wi.z;
            break;
        default:
            return sample_delta(v, Lobe(lobe), wo);
    }
    const bool reflects = wi.z > 0.0f;
    const bool passes =
        !plain && wi.z < 0.0f && (lobe == Interface || lobe == Sheet || lobe == CosineBack);
    if (!reflects && !passes) return std::nullopt;
    BsdfSample s;
    s.wi = renormalize(frame_.from_local(wi));
    if (reflects ? !is_above(s.wi) : !(s.wi.dot(ng_) < 0.0f)) return std::nullopt;
    BsdfValue value;
    evaluate_local<plain>(v, wi, value);
    if (!(value.pdf > 0.0f)) return std::nullopt;
    s.f = value.f();
    s.pdf = value.pdf;
    s.kind = value.kind;
    s.eta = value.eta;
    return s;
}

Rgb Bsdf::albedo() const {
    if (kind_ == Kind::Lambert) return clamp01(p_.diffuse);
    if (is_fibre()) return clamp01(HairLobes::albedo(fibre_->view));
    const Rgb passed = one_minus(view_.specular);
    const Rgb base =
        is_thin() || has_tint()
            ? view_.reflected + passed * (p_.diffuse + p_.diffuse_transmitted) * opacity() +
                  view_.through * (1.0f - opacity())
            : view_.specular + passed * (p_.diffuse * opacity() + Rgb(1.0f - opacity()));
    const Rgb below = Rgb(view_.coat) + base * (1.0f - view_.coat);
    if (!has_sheen()) return clamp01(below);
    return clamp01(below * under_sheen(view_.sheen) + p_.sheen_color * view_.sheen);
}

Rgb Bsdf::entering() const {
    if (kind_ == Kind::Lambert) return Rgb(1.0f);
    if (is_fibre()) return Rgb(0.0f);
    const float under = (1.0f - view_.coat) * (has_sheen() ? under_sheen(view_.sheen) : 1.0f);
    return one_minus(view_.specular) * (opacity() * under);
}

bool Bsdf::has_non_delta() const {
    if (kind_ == Kind::Lambert) return !is_black(p_.diffuse);
    if (is_fibre()) return true;
    for (const Lobe lobe : {Cosine, Specular, Coat, Interface, Sheet, CosineBack}) {
        if (view_.probability[lobe] > 0.0f) return true;
    }
    return false;
}

float Bsdf::broad_share() const {
    constexpr float broad_alpha = 0.1f;
    float share = view_.probability[Cosine] + view_.probability[CosineBack];
    if ((is_anisotropic() ? std::min(p_.alpha, p_.alpha_y) : p_.alpha) >= broad_alpha)
        share +=
            view_.probability[Specular] + view_.probability[Interface] + view_.probability[Sheet];
    if (p_.clearcoat_alpha >= broad_alpha) share += view_.probability[Coat];
    return share;
}

template Bsdf::View Bsdf::make_view<true>(const Vec3&) const;
template Bsdf::View Bsdf::make_view<false>(const Vec3&) const;
template GgxAlbedo Bsdf::specular_albedo<true>(const Vec3&, float) const;
template GgxAlbedo Bsdf::specular_albedo<false>(const Vec3&, float) const;

}  // namespace velatura::shading
