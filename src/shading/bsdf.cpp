// SPDX-License-Identifier: Apache-2.0
#include "shading/bsdf.h"

#include "sampling/warp.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::shading {

namespace {

/// Bends ns towards wo until wo is clearly in front of it; both are unit and on the same side of
/// the surface. ng is on the side of wo.
Vec3 bent_normal(const Vec3& ns, const Vec3& ng, const Vec3& wo) {
    constexpr float min = 1e-3f;  // cosine between ns and wo
    const float facing = ns.dot(wo);
    if (facing >= min) return ns;
    // The geometric normal faces wo by definition: walk towards it just as far as needed
    const float front = ng.dot(wo);
    if (front <= min) return ng;
    const float t = (min - facing) / (front - facing);
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
    const float min = std::min(0.9f * ng.dot(wo), 1e-2f);
    const float height = mirrored.dot(ng);
    if (height >= min || mirrored.dot(horizon) >= min) return ns;
    const Vec3 along = mirrored - ng * height;
    const float length2 = along.dot(along);
    if (!(length2 > 0.0f && min > 0.0f)) return ng;
    const Vec3 raised = along * std::sqrt((1.0f - min * min) / length2) + ng * min;
    return normalize(wo + raised);
}

}  // namespace

Bsdf::Bsdf(const SurfaceParameters& parameters,
           const Vec3& ng,
           const Vec3& ns,
           const Vec3& wo,
           const Vec3& horizon)
    : p_(parameters), wo_(wo) {
    features_.base_opacity = p_.opacity;
    features_.thin = p_.is_thin;
    features_.rough_base = p_.diffuse_roughness > 0.0f;
    ggx_.f0 = p_.f0;
    ggx_.f90 = p_.f90;
    ggx_.alpha = p_.alpha;
    ggx_.alpha_y = p_.alpha_y;
    if (p_.film) {
        ggx_.film.emplace(*p_.film, ggx_.f0, ggx_.f90);
        ggx_.f0 = ggx_.film->at(1.0f);
        ggx_.f90 = ggx_.film->at(0.0f);
    }
    const bool is_behind = ng.dot(wo) < 0.0f;
    ng_ = is_behind ? -ng : ng;
    horizon_ = is_behind ? -horizon : horizon;
    has_specular_ = !(is_black(ggx_.f0) && is_black(ggx_.f90));
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
    return !features_.transmits() && !features_.is_thin() && !features_.has_rough_base() &&
           !p_.anisotropic && !p_.sheen && !p_.film && !(p_.clearcoat > 0.0f);
}

/// Those that may have a share, in their order.
template <bool plain>
constexpr auto Bsdf::lobes() {
    if constexpr (plain) {
        return std::array<LobeId, 3>{Cosine, Specular, MirrorSpecular};
    } else {
        return std::array{Cosine,     Specular,       Coat,       Interface,   Sheet,
                          CosineBack, MirrorSpecular, MirrorCoat, Transmission};
    }
}

/// Everything but normals.
template <bool plain>
void Bsdf::set_layers(bool is_behind) {
    ggx_.is_delta = !has_specular_ || ggx_.alpha < specular_switch_alpha;
    if (!plain) set_sides(is_behind);
    if (!has_specular_ && !features_.has_extras<plain>() && features_.opacity<plain>() == 1.0f &&
        !features_.transmits_diffusely<plain>()) {
        set_lambert();
        return;
    }
    const bool is_lit_below = !(is_black(p_.diffuse) && is_black(p_.diffuse_transmitted));
    // A mirror alone asks for one cosine
    if (ggx_.has_film<plain>() && (!ggx_.is_delta || is_lit_below)) ggx_.film->prepare_means();
    GgxAlbedo average;
    if (!plain && p_.anisotropic && !ggx_.is_delta) {
        set_anisotropy();
        average = ggx_.two_widths->average();
    } else {
        ggx_.curve = GgxAlbedoCurve(has_specular_ ? ggx_.alpha : 0.0f);
        average = ggx_.curve.average();
    }
    ggx_.average_loss = average.loss;
    Rgb f_average = ggx_.f0 + (ggx_.f90 - ggx_.f0) * (1.0f / 21.0f);
    if (ggx_.has_film<plain>() && average.loss > 0.0f) f_average = ggx_.mean_fresnel();
    ggx_.multiple_f = multiple_scattering_fresnel(f_average, average.loss);
    specular_average_ = average.reflectance(ggx_.f0, ggx_.f90) + ggx_.multiple_f * average.loss;
    // Only what lies below asks for it
    if (ggx_.has_film<plain>() && is_lit_below) specular_average_ += ggx_.film_average();
    if (!plain) set_interfaces(f_average, average);
    view_ = make_view<plain>(frame_.to_local(wo_));
}

/// What is on the side of wo, and what lies beyond.
void Bsdf::set_sides(bool is_behind) {
    if (features_.transmits() && !features_.is_thin()) {
        eta_ = is_behind ? 1.0f / p_.ior : p_.ior;
        features_.dense_side = eta_ < 1.0f;
    }
    features_.tint = features_.transmits() && p_.transmission_tint != Rgb(1.0f);
    // The coat lies on the outside, on both sides of a sheet; index 1 has no interface
    const bool is_outside = !(features_.transmits() && is_behind && !features_.is_thin());
    features_.coat = p_.clearcoat > 0.0f && coat_ior() != 1.0f && is_outside;
    features_.sheen = p_.sheen != nullptr && is_outside;
    if (features_.has_sheen()) sheen_ = {p_.sheen, p_.sheen_color, p_.sheen_roughness};
    features_.extras = features_.has_coat() || features_.has_sheen() || features_.has_rough_base();
    features_.diffuse_transmission =
        features_.is_thin() && features_.opacity() > 0.0f && !is_black(p_.diffuse_transmitted);
    if (features_.is_thin()) {
        thin_wall_.ior = p_.ior;
        thin_wall_.opacity = p_.opacity;
        thin_wall_.has_tint = features_.has_tint();
        thin_wall_.tint = p_.transmission_tint;
    }
    coat_.weight = p_.clearcoat;
    coat_.alpha = p_.clearcoat_alpha;
    coat_.is_delta = p_.clearcoat_alpha < specular_switch_alpha;
}

/// Interfaces that blur what they transmit, seen from the dense side, or under a coat.
void Bsdf::set_interfaces(const Rgb& f_average, const GgxAlbedo& average) {
    features_.rough_interface = wants_rough_transmission();
    features_.rough_sheet = features_.is_thin() && features_.transmits() && p_.is_thin_rough &&
                            !ggx_.is_delta && p_.ior != 1.0f;
    if (features_.is_rough_sheet()) thin_wall_.set_compensation(f_average, average.loss);
    if (features_.is_rough_interface()) {
        ggx_.f90 = Rgb(1.0f);
        if (ggx_.film) ggx_.film->set_bare_f90(Rgb(1.0f));
        InterfaceLobe& interface = interface_.emplace();
        interface.eta = eta_;
        interface.is_dense_side = features_.is_dense_side();
        interface.opacity = p_.opacity;
        interface.has_tint = features_.has_tint();
        interface.tint = p_.transmission_tint;
        interface.curve = p_.interface->curve(ggx_.alpha, features_.is_dense_side()
                                                              ? rough_interface::Side::Dense
                                                              : rough_interface::Side::Light);
        const rough_interface::Shares& shares = interface.curve.average();
        interface.lost_average = ggx_.f0 * average.loss + one_minus(ggx_.f0) * shares.excess;
        if (ggx_.film)
            interface.lost_average =
                clamp01(interface.lost_average + interface.film_loss_average(ggx_));
        specular_average_ = interface.average(ggx_);
    } else if (features_.is_dense_side()) {
        // Seen from the dense side, 1 − R_avg shrinks by η² (1 − F_in = (1 − F_out)/η²)
        specular_average_ = one_minus(one_minus(specular_average_) * (eta_ * eta_));
    }
    if (!features_.has_coat()) return;
    coat_.set(coat_ior());
    const bool is_diffuse = !is_black(p_.diffuse) || features_.transmits_diffusely();
    if (is_diffuse && features_.opacity() > 0.0f)
        coat_.set_coupling(
            one_minus(specular_average_), ggx_.f90 - ggx_.f0,
            ggx_.is_anisotropic() ? std::sqrt(ggx_.alpha * ggx_.alpha_y) : ggx_.alpha);
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
    lambert_.albedo = p_.diffuse;
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
    if (p_.interface == nullptr || !features_.transmits() || ggx_.is_delta) return false;
    if (features_.is_thin()) return false;
    const float turn = ggx_.alpha * std::abs(1.0f - eta_) / std::max(eta_, 1.0f);
    return turn >= specular_switch_alpha;
}

/// Turns the frame about the normal to where the tangent points.
void Bsdf::set_anisotropy() {
    ggx_.two_widths = p_.anisotropic->curve({ggx_.alpha, ggx_.alpha_y});
    const Vec3 along = p_.tangent - frame_.z * frame_.z.dot(p_.tangent);
    const float length2 = along.dot(along);
    if (!(length2 > 1e-12f)) return;
    frame_.x = along / std::sqrt(length2);
    frame_.y = cross(frame_.z, frame_.x);
}

/// Directional albedo R(μ) of the base's specular reflection. Transmission across the interface is
/// 1 − R(μ), equal for the two directions of a refracted pair: both ask for the cosine on the side
/// of the smaller index.
Rgb Bsdf::interface_albedo(const Vec3& w) const {
    Vec3 outer = w;
    if (features_.is_dense_side()) {
        const float cosine = refracted_cosine(w.z, eta_);
        if (cosine < 0.0f) return Rgb(1.0f);
        outer = Vec3(w.x / eta_, w.y / eta_, cosine);
    }
    const GgxAlbedo a = ggx_.albedo<false>(outer, outer.z);
    return ggx_.reflectance(a, outer);
}

template <bool plain>
LayerView Bsdf::make_view(const Vec3& wo_local) const {
    LayerView v;
    v.wo = wo_local;
    v.mu = std::clamp(wo_local.z, 0.0f, 1.0f);
    const Vec3 clamped(wo_local.x, wo_local.y, v.mu);
    if (features_.is_rough_interface<plain>()) {
        const rough_interface::Shares shares = interface_->curve.at(clamped);
        v.lost = interface_->loss(ggx_, clamped, shares);
        v.specular = interface_->reflectance(ggx_, clamped, shares);
        v.single_scatter = v.specular - v.lost;
    } else {
        const GgxAlbedo a = ggx_.albedo<plain>(clamped, v.mu);
        v.loss = a.loss;
        v.specular = features_.is_dense_side<plain>() ? interface_albedo(clamped)
                                                      : ggx_.reflectance<plain>(a, clamped);
        v.single_scatter = features_.is_dense_side<plain>()
                               ? v.specular * (1.0f - a.loss)
                               : ggx_.single_reflectance<plain>(a, clamped);
    }
    v.reflected = v.specular;
    v.through = one_minus(v.specular);
    if (features_.is_thin<plain>() && features_.transmits<plain>()) {
        thin_wall_.set_view(v);
    } else if (features_.has_tint<plain>()) {
        v.through = v.through * p_.transmission_tint;
    }
    if (features_.has_coat<plain>()) coat_.set_view(v);
    if (features_.has_sheen<plain>()) v.sheen = sheen_.albedo(v.mu);
    set_probabilities<plain>(v);
    return v;
}

/// Picks lobes in proportion to what each sends towards wo.
template <bool plain>
void Bsdf::set_probabilities(LayerView& v) const {
    const float under_coat = 1.0f - v.coat;
    const Rgb passed = one_minus(v.specular);
    float weight[LobeCount] = {};
    const float reflected = under_coat * mean(v.single_scatter);
    const float transmitted = under_coat * (1.0f - features_.opacity<plain>()) * mean(v.through);
    if (features_.is_rough_interface<plain>()) {
        weight[Interface] = reflected + transmitted;
    } else if (features_.is_rough_sheet<plain>()) {
        weight[Sheet] = reflected + transmitted * (1.0f - v.loss);
        weight[CosineBack] = transmitted * v.loss;
    } else {
        weight[ggx_.is_delta ? MirrorSpecular : Specular] = reflected;
        weight[Transmission] = transmitted;
    }
    weight[Cosine] = under_coat * (features_.opacity<plain>() * mean(p_.diffuse * passed) +
                                   mean(v.reflected - v.single_scatter)) +
                     (v.coat - v.coat_single);
    if (features_.transmits_diffusely<plain>())
        weight[CosineBack] +=
            under_coat * features_.opacity<plain>() * mean(p_.diffuse_transmitted * passed);
    if (features_.has_coat<plain>()) weight[coat_.is_delta ? MirrorCoat : Coat] = v.coat_single;
    if (features_.has_sheen<plain>()) {
        for (float& w : weight) w *= sheen_.under(v.sheen);
        weight[Cosine] += mean(sheen_.color) * v.sheen;
    }
    float sum = 0;
    for (const LobeId i : lobes<plain>()) {
        weight[i] = std::max(weight[i], 0.0f);
        sum += weight[i];
    }
    if (!(sum > 0.0f)) return;
    for (const LobeId i : lobes<plain>()) {
        // Most lobes are not there, and need no division
        if (weight[i] > 0.0f) v.probability[i] = weight[i] / sum;
    }
}

std::optional<BsdfSample> Bsdf::sample_delta(const LayerView& v,
                                             LobeId lobe,
                                             const Vec3& wo) const {
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
        weight = v.through * ((1.0f - features_.opacity()) * under_coat / (eta_ * eta_));
    } else {
        s.wi = frame_.from_local(Vec3(-v.wo.x, -v.wo.y, v.wo.z));
        if (!is_above(s.wi)) return std::nullopt;
        s.is_coat = lobe == MirrorCoat;
        weight = lobe == MirrorSpecular ? v.reflected * under_coat : Rgb(v.coat);
    }
    if (features_.has_sheen()) weight *= sheen_.under(v.sheen);
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
    for (const LobeId lobe : {MirrorSpecular, MirrorCoat, Transmission}) {
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

std::optional<BsdfSample> Bsdf::sample_lambert(const Vec2& u) const {
    const Vec3 wi = lambert_.sample(u);
    if (!(wi.z > 0.0f)) return std::nullopt;
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
    if (is_hair()) return sample_hair(wo, u_lobe, u);
    if (!(wo.dot(frame_.z) > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;
    return sample_lambert(u);
}

template <bool plain>
std::optional<BsdfSample> Bsdf::sample_layers(const Vec3& wo, float u_lobe, const Vec2& u) const {
    std::optional<LayerView> other;
    if (wo != wo_) other = make_view<plain>(frame_.to_local(wo));
    const LayerView& v = other ? *other : view_;
    if (!(v.wo.z > 0.0f) || !(wo.dot(ng_) > 0.0f)) return std::nullopt;

    // Pick a lobe; rounding of the sum falls to the last one that has a share
    int lobe = -1;
    for (const LobeId i : lobes<plain>()) {
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
            wi = ggx_.sample<plain>(v.wo, u);
            break;
        case Coat:
            wi = ggx_sample(v.wo, coat_.alpha, u);
            break;
        case Interface:
            wi = interface_->sample(ggx_, v, std::min(u_lobe / v.probability[Interface], 1.0f), u);
            break;
        case Sheet:
            wi = thin_wall_.sample(ggx_, v, std::min(u_lobe / v.probability[Sheet], 1.0f), u);
            break;
        case CosineBack:
            wi = sampling::cosine_hemisphere(u);
            wi.z = -wi.z;
            break;
        default:
            return sample_delta(v, LobeId(lobe), wo);
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
    if (is_hair()) return clamp01(HairLobes::albedo(fiber_->view));
    const Rgb passed = one_minus(view_.specular);
    const Rgb base =
        features_.is_thin() || features_.has_tint()
            ? view_.reflected +
                  passed * (p_.diffuse + p_.diffuse_transmitted) * features_.opacity() +
                  view_.through * (1.0f - features_.opacity())
            : view_.specular +
                  passed * (p_.diffuse * features_.opacity() + Rgb(1.0f - features_.opacity()));
    const Rgb below = Rgb(view_.coat) + base * (1.0f - view_.coat);
    if (!features_.has_sheen()) return clamp01(below);
    return clamp01(below * sheen_.under(view_.sheen) + sheen_.color * view_.sheen);
}

Rgb Bsdf::entering() const {
    if (kind_ == Kind::Lambert) return Rgb(1.0f);
    if (is_hair()) return Rgb(0.0f);
    const float under =
        (1.0f - view_.coat) * (features_.has_sheen() ? sheen_.under(view_.sheen) : 1.0f);
    return one_minus(view_.specular) * (features_.opacity() * under);
}

bool Bsdf::has_non_delta() const {
    if (kind_ == Kind::Lambert) return !is_black(p_.diffuse);
    if (is_hair()) return true;
    for (const LobeId lobe : {Cosine, Specular, Coat, Interface, Sheet, CosineBack}) {
        if (view_.probability[lobe] > 0.0f) return true;
    }
    return false;
}

float Bsdf::mirror_probability() const {
    if (kind_ == Kind::Lambert || is_hair()) return 0.0f;
    return view_.probability[MirrorSpecular] + view_.probability[MirrorCoat];
}

void Bsdf::raise_mirror(float probability) {
    const float before = mirror_probability();
    if (!(before > 0.0f) || !(before < 1.0f)) return;
    const float raised = probability / before, rest = (1.0f - probability) / (1.0f - before);
    for (int lobe = 0; lobe < LobeCount; ++lobe)
        view_.probability[lobe] *= lobe == MirrorSpecular || lobe == MirrorCoat ? raised : rest;
}

float Bsdf::broad_share() const {
    constexpr float broad_alpha = 0.1f;
    float share = view_.probability[Cosine] + view_.probability[CosineBack];
    if ((ggx_.is_anisotropic() ? std::min(ggx_.alpha, ggx_.alpha_y) : ggx_.alpha) >= broad_alpha)
        share +=
            view_.probability[Specular] + view_.probability[Interface] + view_.probability[Sheet];
    if (p_.clearcoat_alpha >= broad_alpha) share += view_.probability[Coat];
    return share;
}

template LayerView Bsdf::make_view<true>(const Vec3&) const;
template LayerView Bsdf::make_view<false>(const Vec3&) const;

}  // namespace velatura::shading
