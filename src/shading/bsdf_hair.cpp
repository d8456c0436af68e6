// SPDX-License-Identifier: Apache-2.0
// A fibre as a scattering function of a surface.
#include "shading/bsdf.h"

namespace velatura::shading {

Bsdf::Bsdf(const HairParameters& hair, float h, const Vec3& along, const Vec3& ng, const Vec3& wo)
    : wo_(wo), has_specular_(false) {
    kind_ = Kind::Hair;
    transmits_diffusely_ = true;
    ng_ = horizon_ = ng.dot(wo) < 0.0f ? -ng : ng;
    // The normal across the fibre, on the side of wo
    const Vec3 across = ng_ - along * along.dot(ng_);
    const float length2 = across.dot(across);
    frame_.x = along;
    frame_.z = length2 > 1e-12f ? across / std::sqrt(length2) : Frame::from_z(along).x;
    frame_.y = cross(frame_.z, frame_.x);
    const HairLobes lobes(hair, h);
    fibre_ = Fibre{lobes, lobes.view(frame_.to_local(wo))};
}

/// The path loop multiplies by cosine(wi), which means nothing to a fibre.
BsdfValue Bsdf::hair_value(const HairLobes::View& view, const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    const float factor = cosine(wi);
    if (!(factor > 0.0f)) return value;
    const HairLobes::Value scattered = fibre_->lobes.evaluate(view, frame_.to_local(wi));
    value.specular = scattered.f_cosine / factor;
    value.pdf = scattered.pdf;
    const bool passes = (wi.dot(frame_.z) > 0.0f) != (wo.dot(frame_.z) > 0.0f);
    value.kind = passes ? ScatterKind::Transmit : ScatterKind::Reflect;
    return value;
}

BsdfValue Bsdf::evaluate_hair(const Vec3& wo, const Vec3& wi) const {
    if (wo == wo_) return hair_value(fibre_->view, wo, wi);
    return hair_value(fibre_->lobes.view(frame_.to_local(wo)), wo, wi);
}

std::optional<BsdfSample> Bsdf::sample_hair(const Vec3& wo, float u_lobe, const Vec2& u) const {
    std::optional<HairLobes::View> other;
    if (wo != wo_) other = fibre_->lobes.view(frame_.to_local(wo));
    const HairLobes::View& view = other ? *other : fibre_->view;
    BsdfSample s;
    s.wi = renormalize(frame_.from_local(fibre_->lobes.sample(view, u_lobe, u)));
    const BsdfValue value = hair_value(view, wo, s.wi);
    if (!(value.pdf > 0.0f)) return std::nullopt;
    s.f = value.f();
    s.pdf = value.pdf;
    s.kind = value.kind;
    return s;
}

}  // namespace velatura::shading
