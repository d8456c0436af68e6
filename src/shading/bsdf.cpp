// SPDX-License-Identifier: Apache-2.0
#include "shading/bsdf.h"

#include "sampling/warp.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"

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

Rgb clamp01(const Rgb& c) {
    return {std::clamp(c.x, 0.0f, 1.0f), std::clamp(c.y, 0.0f, 1.0f), std::clamp(c.z, 0.0f, 1.0f)};
}

/// What a reflectance leaves; rounding must not make it negative.
Rgb one_minus(const Rgb& c) {
    return {std::max(1.0f - c.x, 0.0f), std::max(1.0f - c.y, 0.0f), std::max(1.0f - c.z, 0.0f)};
}

float mean(const Rgb& c) {
    return (c.x + c.y + c.z) * (1.0f / 3.0f);
}

/// a / b per channel, 0 where b is 0.
Rgb safe_divide(const Rgb& a, const Rgb& b) {
    return {b.x > 0.0f ? a.x / b.x : 0.0f, b.y > 0.0f ? a.y / b.y : 0.0f,
            b.z > 0.0f ? a.z / b.z : 0.0f};
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
    const bool transmits = p_.opacity < 1.0f;
    if (transmits) {
        eta_ = is_behind ? 1.0f / p_.ior : p_.ior;
        is_dense_side_ = eta_ < 1.0f;
    }
    // The coat lies on the outside; index 1 has no interface
    has_coat_ = p_.clearcoat > 0.0f && p_.ior != 1.0f && !(transmits && is_behind);
    specular_is_delta_ = !has_specular_ || p_.alpha < specular_switch_alpha;
    coat_is_delta_ = p_.clearcoat_alpha < specular_switch_alpha;
    if (is_lambert()) {
        view_.wo = frame_.to_local(wo);
        view_.probability[Cosine] = is_black(p_.diffuse) ? 0.0f : 1.0f;
        return;
    }
    specular_curve_ = GgxAlbedoCurve(has_specular_ ? p_.alpha : 0.0f);
    const GgxAlbedo average = specular_curve_.average();
    average_loss_ = average.loss;
    const Rgb f_average = p_.f0 + (p_.f90 - p_.f0) * (1.0f / 21.0f);
    multiple_f_ = multiple_scattering_fresnel(f_average, average.loss);
    specular_average_ = average.reflectance(p_.f0, p_.f90) + multiple_f_ * average.loss;
    is_rough_interface_ = wants_rough_transmission();
    if (is_rough_interface_) {
        p_.f90 = Rgb(1.0f);
        interface_curve_ = p_.interface->curve(
            p_.alpha, is_dense_side_ ? rough_interface::Side::Dense : rough_interface::Side::Light);
        const rough_interface::Shares& shares = interface_curve_->average();
        lost_average_ = p_.f0 * average.loss + one_minus(p_.f0) * shares.excess;
        specular_average_ = one_minus(one_minus(p_.f0) * shares.passed);
    } else if (is_dense_side_) {
        // Seen from the dense side, 1 − R_avg shrinks by η² (RIGOR 2.2: 1 − F_in = (1 − F_out)/η²)
        specular_average_ = one_minus(one_minus(specular_average_) * (eta_ * eta_));
    }
    if (has_coat_) set_coat();
    view_ = make_view(frame_.to_local(wo));
}

/// ns, in the hemisphere of ng and on the side of wo, bent as far as wo and reflection ask for.
Vec3 Bsdf::shading_normal(const Vec3& ns, const Vec3& wo) const {
    const Vec3 bent = bent_normal(bent_normal(ns, ng_, ng_), ng_, wo);
    if (!has_specular_ && !(p_.clearcoat > 0.0f)) return bent;
    return reflecting_normal(bent, ng_, horizon_, wo);
}

/// Blurred refraction, unless it turns directions by less than what counts as a mirror's blur.
bool Bsdf::wants_rough_transmission() const {
    if (p_.interface == nullptr || p_.opacity >= 1.0f || specular_is_delta_) return false;
    const float turn = p_.alpha * std::abs(1.0f - eta_) / std::max(eta_, 1.0f);
    return turn >= specular_switch_alpha;
}

void Bsdf::set_coat() {
    const float r = (1.0f - p_.ior) / (1.0f + p_.ior);
    coat_f0_ = r * r;
    coat_curve_ = GgxAlbedoCurve(p_.clearcoat_alpha);
    const GgxAlbedo coat = coat_curve_.average();
    coat_average_loss_ = coat.loss;
    coat_multiple_f_ =
        multiple_scattering_fresnel(Rgb(coat_f0_ + (1.0f - coat_f0_) * (1.0f / 21.0f)), coat.loss)
            .x;
    if (is_black(p_.diffuse) || !(p_.opacity > 0.0f)) return;
    // The base receives (1 − C)(1 − R) of both directions, over the mean of that product: the
    // product of the means and the covariance of the two Schlick terms, 1/66 − 1/441 for mirrors
    const float coat_average = p_.clearcoat * (coat.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x +
                                               coat_multiple_f_ * coat.loss);
    const float covariance = p_.clearcoat * (1.0f - coat_f0_) * (1.0f / 66.0f - 1.0f / 441.0f) *
                             schlick_spread(p_.clearcoat_alpha) * schlick_spread(p_.alpha);
    const Rgb under_base = one_minus(specular_average_);
    coat_coupling_ =
        safe_divide(under_base, under_base * (1.0f - coat_average) + (p_.f90 - p_.f0) * covariance);
}

/// What single scattering at a rough interface loses, and compensation returns.
Rgb Bsdf::rough_loss(float mu, const rough_interface::Shares& shares) const {
    return p_.f0 * specular_curve_.at(mu).loss + one_minus(p_.f0) * shares.excess;
}

/// Directional albedo R(μ) of the base's specular reflection. Transmission across the interface is
/// 1 − R(μ), equal for the two directions of a refracted pair: both ask for the cosine on the side
/// of the smaller index.
Rgb Bsdf::interface_albedo(float mu) const {
    float outer = mu;
    if (is_dense_side_) {
        outer = refracted_cosine(mu, eta_);
        if (outer < 0.0f) return Rgb(1.0f);
    }
    const GgxAlbedo a = specular_curve_.at(outer);
    return a.reflectance(p_.f0, p_.f90) + multiple_f_ * a.loss;
}

Bsdf::View Bsdf::make_view(const Vec3& wo_local) const {
    View v;
    v.wo = wo_local;
    v.mu = std::clamp(wo_local.z, 0.0f, 1.0f);
    if (is_rough_interface_) {
        const rough_interface::Shares shares = interface_curve_->at(v.mu);
        v.lost = rough_loss(v.mu, shares);
        v.specular = one_minus(one_minus(p_.f0) * shares.passed);
        v.single_scatter = v.specular - v.lost;
    } else {
        const GgxAlbedo a = specular_curve_.at(v.mu);
        v.loss = a.loss;
        v.specular = is_dense_side_ ? interface_albedo(v.mu)
                                    : a.reflectance(p_.f0, p_.f90) + multiple_f_ * a.loss;
        v.single_scatter =
            is_dense_side_ ? v.specular * (1.0f - a.loss) : a.reflectance(p_.f0, p_.f90);
    }
    if (has_coat_) {
        const GgxAlbedo c = coat_curve_.at(v.mu);
        v.coat_loss = c.loss;
        v.coat_single = p_.clearcoat * c.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x;
        v.coat = v.coat_single + p_.clearcoat * coat_multiple_f_ * c.loss;
    }
    set_probabilities(v);
    return v;
}

/// Picks lobes in proportion to what each sends towards wo.
void Bsdf::set_probabilities(View& v) const {
    const float under_coat = 1.0f - v.coat;
    const Rgb passed = one_minus(v.specular);
    float weight[LobeCount] = {};
    const float reflected = under_coat * mean(v.single_scatter);
    const float transmitted = under_coat * (1.0f - p_.opacity) * mean(passed);
    if (is_rough_interface_) {
        weight[Interface] = reflected + transmitted;
    } else {
        weight[specular_is_delta_ ? MirrorSpecular : Specular] = reflected;
        weight[Transmission] = transmitted;
    }
    weight[Cosine] = under_coat * (p_.opacity * mean(p_.diffuse * passed) +
                                   mean(v.specular - v.single_scatter)) +
                     (v.coat - v.coat_single);
    if (has_coat_) weight[coat_is_delta_ ? MirrorCoat : Coat] = v.coat_single;
    float sum = 0;
    for (float& w : weight) {
        w = std::max(w, 0.0f);
        sum += w;
    }
    if (!(sum > 0.0f)) return;
    for (int i = 0; i < LobeCount; ++i) v.probability[i] = weight[i] / sum;
}

bool Bsdf::is_above(const Vec3& w) const {
    return w.dot(ng_) > 0.0f || w.dot(horizon_) > 0.0f;
}

BsdfValue Bsdf::evaluate(const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    if (!(wo.dot(ng_) > 0.0f)) return value;
    const Vec3 wi_local = frame_.to_local(wi);
    // Light through the surface comes by refraction alone, whatever the shading normal says
    const bool reflects = is_above(wi);
    if (reflects ? !(wi_local.z > 0.0f) : !(is_rough_interface_ && wi_local.z < 0.0f)) return value;
    if (wo == wo_) {
        if (view_.wo.z > 0.0f) evaluate_local(view_, wi_local, value);
        return value;
    }
    const View view = make_view(frame_.to_local(wo));
    if (view.wo.z > 0.0f) evaluate_local(view, wi_local, value);
    return value;
}

void Bsdf::evaluate_local(const View& v, const Vec3& wi, BsdfValue& value) const {
    if (wi.z < 0.0f) {
        evaluate_refraction(v, wi, value);
        return;
    }
    const float mu_i = std::min(wi.z, 1.0f);
    value.pdf = v.probability[Cosine] * sampling::cosine_hemisphere_pdf(mu_i);
    if (is_lambert()) {
        value.diffuse = p_.diffuse * inv_pi;
        return;
    }
    Vec3 wm = v.wo + wi;
    const float wm_length2 = wm.dot(wm);
    wm = wm_length2 > 0.0f ? wm / std::sqrt(wm_length2) : Vec3(0.0f);
    const float cos_m = std::clamp(v.wo.dot(wm), 0.0f, 1.0f);

    // Specular reflection of the base, and what its interface reflects in all
    Rgb specular_i;
    if (is_rough_interface_) {
        specular_i = add_rough_reflection(v, mu_i, wm, cos_m, value);
    } else {
        specular_i = add_reflection(v, mu_i, wm, cos_m, value);
    }

    // Diffuse base: what passes the interface on the way in and out, over its mean
    if (p_.opacity > 0.0f) {
        value.diffuse = safe_divide(
            p_.diffuse * (p_.opacity * inv_pi) * one_minus(v.specular) * one_minus(specular_i),
            one_minus(specular_average_));
    }
    if (has_coat_) add_coat(v, mu_i, wm, cos_m, value);
}

/// Adds the GGX lobe of an opaque base, or of one that refracts without blur; wm may be zero.
/// Returns: the albedo of the reflection for mu_i.
Rgb Bsdf::add_reflection(
    const View& v, float mu_i, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const GgxAlbedo albedo_i = specular_curve_.at(mu_i);
    if (!specular_is_delta_) {
        // From inside a rough interface the reflectance is that of the macroscopic normal, so that
        // R + T = 1
        const Rgb fresnel = is_dense_side_ ? v.specular : fresnel_schlick(p_.f0, p_.f90, cos_m);
        const Rgb multiple = is_dense_side_ ? v.specular : multiple_f_;
        if (wm.z > 0.0f) {
            value.specular +=
                fresnel * (ggx_d(wm, p_.alpha) * ggx_visibility(v.mu, mu_i, p_.alpha));
            value.pdf += v.probability[Specular] * ggx_pdf(v.wo, wm, p_.alpha);
        }
        if (average_loss_ > 0.0f) {
            value.specular += multiple * (v.loss * albedo_i.loss * inv_pi / average_loss_);
        }
    }
    return is_dense_side_ ? interface_albedo(mu_i)
                          : albedo_i.reflectance(p_.f0, p_.f90) + multiple_f_ * albedo_i.loss;
}

/// The same for an interface that blurs what it refracts.
Rgb Bsdf::add_rough_reflection(
    const View& v, float mu_i, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const rough_interface::Shares shares = interface_curve_->at(mu_i);
    if (wm.z > 0.0f && cos_m > 0.0f) {
        const Rgb fresnel = microfacet_fresnel(cos_m);
        value.specular += fresnel * (ggx_d(wm, p_.alpha) * ggx_visibility(v.mu, mu_i, p_.alpha));
        value.pdf += v.probability[Interface] * reflect_share(fresnel) *
                     ggx_normal_pdf(v.wo, wm, cos_m, p_.alpha) / (4.0f * cos_m);
    }
    value.specular += safe_divide(v.lost * rough_loss(mu_i, shares) * inv_pi, lost_average_);
    return one_minus(one_minus(p_.f0) * shares.passed);
}

/// Refraction at the one microfacet that turns wi to wo. Ref: Walter et al. 2007, equations 16, 17
/// and 21; f carries the 1/η² of radiance.
void Bsdf::evaluate_refraction(const View& v, const Vec3& wi, BsdfValue& value) const {
    value.kind = ScatterKind::Transmit;
    value.eta = eta_;
    const Vec3 across = v.wo + wi * eta_;
    const float length2 = across.dot(across);
    if (!(length2 > 0.0f)) return;
    const Vec3 wm = across * ((eta_ > 1.0f ? -1.0f : 1.0f) / std::sqrt(length2));
    const float cos_o = v.wo.dot(wm), cos_i = -wi.dot(wm);
    if (!(wm.z > 0.0f && cos_o > 0.0f && cos_i > 0.0f)) return;
    const Rgb fresnel =
        fresnel_schlick(p_.f0, p_.f90, std::min(is_dense_side_ ? cos_i : cos_o, 1.0f));
    const float mu_i = std::min(-wi.z, 1.0f);
    const float visible = ggx_normal_pdf(v.wo, wm, cos_o, p_.alpha);
    const float jacobian = cos_i / length2;
    // D·G1(wo)·cos_o / μo is the density of visible normals
    const float unmasked = rough_interface::refraction_weight(v.mu, mu_i, p_.alpha);
    value.specular = one_minus(fresnel) *
                     ((1.0f - p_.opacity) * (1.0f - v.coat) * visible * jacobian * unmasked / mu_i);
    value.pdf = v.probability[Interface] * (1.0f - reflect_share(fresnel)) * visible * jacobian *
                (eta_ * eta_);
}

/// F of one microfacet of a rough interface, by the cosine on the side of the smaller index.
Rgb Bsdf::microfacet_fresnel(float cos_m) const {
    if (!is_dense_side_) return fresnel_schlick(p_.f0, p_.f90, cos_m);
    const float outer = refracted_cosine(cos_m, eta_);
    return outer < 0.0f ? Rgb(1.0f) : fresnel_schlick(p_.f0, p_.f90, outer);
}

/// Probability to reflect at a microfacet, in proportion to what it sends each way.
float Bsdf::reflect_share(const Rgb& fresnel) const {
    const float reflected = mean(fresnel);
    return reflected / (reflected + (1.0f - reflected) * (1.0f - p_.opacity));
}

/// The coat takes its share first. The base below is coupled like the one below the interface;
/// specular lobes, whose directions have much the same cosine, are left what the larger share of
/// the two leaves. Both are reciprocal.
void Bsdf::add_coat(
    const View& v, float mu_i, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const GgxAlbedo c = coat_curve_.at(mu_i);
    const float coat_i =
        p_.clearcoat * (c.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x + coat_multiple_f_ * c.loss);
    value.diffuse *= coat_coupling_ * ((1.0f - v.coat) * (1.0f - coat_i));
    value.specular *= 1.0f - std::max(v.coat, coat_i);
    if (coat_is_delta_) return;
    float coat = 0;
    if (wm.z > 0.0f) {
        coat = (coat_f0_ + (1.0f - coat_f0_) * schlick_weight(cos_m)) *
               (ggx_d(wm, p_.clearcoat_alpha) * ggx_visibility(v.mu, mu_i, p_.clearcoat_alpha));
        value.pdf += v.probability[Coat] * ggx_pdf(v.wo, wm, p_.clearcoat_alpha);
    }
    if (coat_average_loss_ > 0.0f) {
        coat += coat_multiple_f_ * v.coat_loss * c.loss * inv_pi / coat_average_loss_;
    }
    value.specular += Rgb(p_.clearcoat * coat);
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
        weight = one_minus(v.specular) * ((1.0f - p_.opacity) * under_coat / (eta_ * eta_));
    } else {
        s.wi = frame_.from_local(Vec3(-v.wo.x, -v.wo.y, v.wo.z));
        if (!is_above(s.wi)) return std::nullopt;
        weight = lobe == MirrorSpecular ? v.specular * under_coat : Rgb(v.coat);
    }
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
        if (!out) out = DeltaScattering{sample->wi, Rgb(0.0f), sample->eta};
        out->weight += sample->f * cosine(sample->wi);
    }
    return out;
}

/// Draws a visible microfacet and lets it reflect or refract. Zero vector: nothing.
Vec3 Bsdf::sample_interface(const View& v, float u_choice, const Vec2& u) const {
    const Vec3 wm = ggx_sample_normal(v.wo, p_.alpha, u);
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
    std::optional<View> other;
    if (wo != wo_) other = make_view(frame_.to_local(wo));
    const View& v = other ? *other : view_;
    if (!(v.wo.z > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;

    if (is_lambert()) return sample_lambert(u);

    // Pick a lobe; rounding of the sum falls to the last one that has a share
    int lobe = -1;
    for (int i = 0; i < LobeCount; ++i) {
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
            wi = ggx_sample(v.wo, p_.alpha, u);
            break;
        case Coat:
            wi = ggx_sample(v.wo, p_.clearcoat_alpha, u);
            break;
        case Interface:
            wi = sample_interface(v, std::min(u_lobe / v.probability[Interface], 1.0f), u);
            break;
        default:
            return sample_delta(v, Lobe(lobe), wo);
    }
    const bool reflects = wi.z > 0.0f;
    if (!reflects && !(lobe == Interface && wi.z < 0.0f)) return std::nullopt;
    BsdfSample s;
    s.wi = renormalize(frame_.from_local(wi));
    if (reflects ? !is_above(s.wi) : !(s.wi.dot(ng_) < 0.0f)) return std::nullopt;
    BsdfValue value;
    evaluate_local(v, wi, value);
    if (!(value.pdf > 0.0f)) return std::nullopt;
    s.f = value.f();
    s.pdf = value.pdf;
    s.kind = value.kind;
    s.eta = value.eta;
    return s;
}

Rgb Bsdf::albedo() const {
    const Rgb passed = one_minus(view_.specular);
    const Rgb base = view_.specular + passed * (p_.diffuse * p_.opacity + Rgb(1.0f - p_.opacity));
    return clamp01(Rgb(view_.coat) + base * (1.0f - view_.coat));
}

bool Bsdf::has_non_delta() const {
    return view_.probability[Cosine] > 0.0f || view_.probability[Specular] > 0.0f ||
           view_.probability[Coat] > 0.0f || view_.probability[Interface] > 0.0f;
}

float Bsdf::broad_share() const {
    constexpr float broad_alpha = 0.1f;
    float share = view_.probability[Cosine];
    if (p_.alpha >= broad_alpha)
        share += view_.probability[Specular] + view_.probability[Interface];
    if (p_.clearcoat_alpha >= broad_alpha) share += view_.probability[Coat];
    return share;
}

}  // namespace velatura::shading
