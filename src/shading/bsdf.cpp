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

constexpr float coat_f0 = 0.04f;  // ior 1.5

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

}  // namespace

Bsdf::Bsdf(const SurfaceParameters& parameters, const Vec3& ng, const Vec3& ns, const Vec3& wo)
    : p_(parameters), wo_(wo) {
    const bool is_behind = ng.dot(wo) < 0.0f;
    ng_ = is_behind ? -ng : ng;
    const Vec3 front = bent_normal(is_behind ? -ns : ns, ng_, ng_);
    frame_ = Frame::from_z(bent_normal(front, ng_, wo));
    const bool transmits = p_.opacity < 1.0f;
    if (transmits) {
        eta_ = is_behind ? 1.0f / p_.ior : p_.ior;
        is_dense_side_ = eta_ < 1.0f;
    }
    // The coat lies on the outside
    has_coat_ = p_.clearcoat > 0.0f && !(transmits && is_behind);
    specular_is_delta_ = p_.alpha < specular_switch_alpha;
    coat_is_delta_ = p_.clearcoat_alpha < specular_switch_alpha;

    has_specular_ = !(is_black(p_.f0) && is_black(p_.f90));
    specular_is_delta_ = specular_is_delta_ || !has_specular_;
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
    // Seen from the dense side, 1 − R_avg shrinks by η² (RIGOR 2.2: 1 − F_in = (1 − F_out)/η²)
    if (is_dense_side_) {
        specular_average_ = one_minus(one_minus(specular_average_) * (eta_ * eta_));
    }
    if (has_coat_) {
        coat_curve_ = GgxAlbedoCurve(p_.clearcoat_alpha);
        const GgxAlbedo coat = coat_curve_.average();
        coat_average_loss_ = coat.loss;
        coat_multiple_f_ =
            multiple_scattering_fresnel(Rgb(coat_f0 + (1.0f - coat_f0) * (1.0f / 21.0f)), coat.loss)
                .x;
    }
    view_ = make_view(frame_.to_local(wo));
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
    const GgxAlbedo a = specular_curve_.at(v.mu);
    v.loss = a.loss;
    v.specular = is_dense_side_ ? interface_albedo(v.mu)
                                : a.reflectance(p_.f0, p_.f90) + multiple_f_ * a.loss;
    v.single_scatter = is_dense_side_ ? v.specular * (1.0f - a.loss) : a.reflectance(p_.f0, p_.f90);
    if (has_coat_) {
        const GgxAlbedo c = coat_curve_.at(v.mu);
        v.coat_loss = c.loss;
        v.coat_single = p_.clearcoat * c.reflectance(Rgb(coat_f0), Rgb(1.0f)).x;
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
    weight[specular_is_delta_ ? MirrorSpecular : Specular] = under_coat * mean(v.single_scatter);
    weight[Transmission] = under_coat * (1.0f - p_.opacity) * mean(passed);
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

bool Bsdf::is_same_side(const Vec3& wo, const Vec3& wi) const {
    return wo.dot(ng_) > 0.0f && wi.dot(ng_) > 0.0f;
}

BsdfValue Bsdf::evaluate(const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    // Light through the surface comes by the delta lobe alone, whatever the shading normal says
    if (!is_same_side(wo, wi)) return value;
    const Vec3 wi_local = frame_.to_local(wi);
    if (!(wi_local.z > 0.0f)) return value;
    if (wo == wo_) {
        if (view_.wo.z > 0.0f) evaluate_local(view_, wi_local, value);
        return value;
    }
    const View view = make_view(frame_.to_local(wo));
    if (view.wo.z > 0.0f) evaluate_local(view, wi_local, value);
    return value;
}

void Bsdf::evaluate_local(const View& v, const Vec3& wi, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    value.pdf = v.probability[Cosine] * sampling::cosine_hemisphere_pdf(mu_i);
    if (is_lambert()) {
        value.diffuse = p_.diffuse * inv_pi;
        return;
    }
    const GgxAlbedo albedo_i = specular_curve_.at(mu_i);
    const Rgb specular_i = is_dense_side_
                               ? interface_albedo(mu_i)
                               : albedo_i.reflectance(p_.f0, p_.f90) + multiple_f_ * albedo_i.loss;

    // Diffuse base: what passes the interface on the way in and out, over its mean
    if (p_.opacity > 0.0f) {
        value.diffuse = safe_divide(
            p_.diffuse * (p_.opacity * inv_pi) * one_minus(v.specular) * one_minus(specular_i),
            one_minus(specular_average_));
    }

    // Specular reflection of the base
    Vec3 wm = v.wo + wi;
    const float wm_length2 = wm.dot(wm);
    const bool has_half = wm_length2 > 0.0f;
    if (has_half) wm /= std::sqrt(wm_length2);
    const float cos_m = std::clamp(v.wo.dot(wm), 0.0f, 1.0f);
    if (!specular_is_delta_) {
        // From inside a rough interface the reflectance is that of the macroscopic normal, so that
        // R + T = 1
        const Rgb fresnel = is_dense_side_ ? v.specular : fresnel_schlick(p_.f0, p_.f90, cos_m);
        const Rgb multiple = is_dense_side_ ? v.specular : multiple_f_;
        if (has_half) {
            value.specular +=
                fresnel * (ggx_d(wm, p_.alpha) * ggx_visibility(v.mu, mu_i, p_.alpha));
            value.pdf += v.probability[Specular] * ggx_pdf(v.wo, wm, p_.alpha);
        }
        if (average_loss_ > 0.0f) {
            value.specular += multiple * (v.loss * albedo_i.loss * inv_pi / average_loss_);
        }
    }
    if (!has_coat_) return;

    // The coat takes its share first; the larger share of the two directions keeps this reciprocal
    const GgxAlbedo c = coat_curve_.at(mu_i);
    const float coat_i =
        p_.clearcoat * (c.reflectance(Rgb(coat_f0), Rgb(1.0f)).x + coat_multiple_f_ * c.loss);
    const float under_coat = 1.0f - std::max(v.coat, coat_i);
    value.diffuse *= under_coat;
    value.specular *= under_coat;
    if (coat_is_delta_) return;
    float coat = 0;
    if (has_half) {
        coat = (coat_f0 + (1.0f - coat_f0) * schlick_weight(cos_m)) *
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
        if (!(s.wi.dot(ng_) > 0.0f)) return std::nullopt;
        weight = lobe == MirrorSpecular ? v.specular * under_coat : Rgb(v.coat);
    }
    const float length2 = s.wi.dot(s.wi);
    s.wi /= std::sqrt(length2);
    const float cos_i = cosine(s.wi);
    if (!(cos_i > 0.0f)) return std::nullopt;
    s.f = weight / cos_i;
    return s;
}

std::optional<BsdfSample> Bsdf::sample_f(const Vec3& wo, float u_lobe, const Vec2& u) const {
    View other;
    const bool is_cached = wo == wo_;
    if (!is_cached) other = make_view(frame_.to_local(wo));
    const View& v = is_cached ? view_ : other;
    if (!(v.wo.z > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;

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
        default:
            return sample_delta(v, Lobe(lobe), wo);
    }
    if (!(wi.z > 0.0f)) return std::nullopt;
    BsdfSample s;
    s.wi = frame_.from_local(wi);
    s.wi /= std::sqrt(s.wi.dot(s.wi));
    if (!is_same_side(wo, s.wi)) return std::nullopt;
    BsdfValue value;
    evaluate_local(v, wi, value);
    if (!(value.pdf > 0.0f)) return std::nullopt;
    s.f = value.f();
    s.pdf = value.pdf;
    return s;
}

Rgb Bsdf::albedo() const {
    const Rgb passed = one_minus(view_.specular);
    const Rgb base = view_.specular + passed * (p_.diffuse * p_.opacity + Rgb(1.0f - p_.opacity));
    return clamp01(Rgb(view_.coat) + base * (1.0f - view_.coat));
}

bool Bsdf::has_non_delta() const {
    return view_.probability[Cosine] > 0.0f || view_.probability[Specular] > 0.0f ||
           view_.probability[Coat] > 0.0f;
}

}  // namespace velatura::shading
