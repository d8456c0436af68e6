// SPDX-License-Identifier: Apache-2.0
// A fiber as a scattering function of a surface.
#include "shading/bsdf.h"

namespace velatura::shading {

Bsdf::Bsdf(const HairParameters& hair, float h, const Vec3& along, const Vec3& ng, const Vec3& wo)
    : wo_(wo), has_specular_(false) {
    kind_ = Kind::Hair;
    features_.diffuse_transmission = true;
    ng_ = horizon_ = ng.dot(wo) < 0.0f ? -ng : ng;
    // The normal across the fiber, on the side of wo
    const Vec3 across = ng_ - along * along.dot(ng_);
    const float length2 = across.dot(across);
    frame_.x = along;
    frame_.z = length2 > 1e-12f ? across / std::sqrt(length2) : Frame::from_z(along).x;
    frame_.y = cross(frame_.z, frame_.x);
    const HairLobes lobes(hair, h);
    fiber_ = HairLobe{lobes, lobes.view(frame_.to_local(wo))};
}

BsdfValue Bsdf::evaluate_hair(const Vec3& wo, const Vec3& wi) const {
    if (wo == wo_) return fiber_->evaluate(fiber_->view, frame_, wo, wi);
    return fiber_->evaluate(fiber_->lobes.view(frame_.to_local(wo)), frame_, wo, wi);
}

std::optional<BsdfSample> Bsdf::sample_hair(const Vec3& wo, float u_lobe, const Vec2& u) const {
    if (wo == wo_) return fiber_->sample(fiber_->view, frame_, wo, u_lobe, u);
    return fiber_->sample(fiber_->lobes.view(frame_.to_local(wo)), frame_, wo, u_lobe, u);
}

}  // namespace velatura::shading
