// SPDX-License-Identifier: Apache-2.0
#include "integrator/direction_mixture.h"

#include "scene/effect_calls.h"

namespace velatura::integrator {

using sampling::Purpose;
using scene::Effect;

namespace {

/// Share of learned directions where every lobe of the BSDF is broad. The BSDF keeps the rest, so
/// that no weight is more than twice what it is without learning, whatever was learned.
constexpr float guide_share_of_broad = 0.5f;

/// With less than this share of broad lobes, learned directions are not worth looking up.
constexpr float min_broad_share = 0.1f;

}  // namespace

void DirectionMixture::set_guide(const Vec3& p, const guiding::GuidingField& guide) {
    const float broad = bsdf_.broad_share();
    if (broad < min_broad_share) return;
    scene::count_call(Effect::Guiding);
    guide_ = guide.at({p, bsdf_.ns()});
    guide_share_ = guide_share_of_broad * broad;
}

std::optional<ScatterSample> DirectionMixture::sample(const sampling::PixelSampler& sampler,
                                                      int bounce,
                                                      uint32_t repeat) const {
    if (guide_ && sampler.get_1d(bounce, Purpose::GuideSelect, repeat) < guide_share_) {
        return sample_guide(sampler.get_2d(bounce, Purpose::GuideDirection, repeat));
    }
    const float u_lobe =
        bsdf_.is_lambert() ? 0.0f : sampler.get_1d(bounce, Purpose::BsdfLobe, repeat);
    const Vec2 u = sampler.get_2d(bounce, Purpose::BsdfDirection, repeat);
    const std::optional<shading::BsdfSample> sample = bsdf_.sample_f(wo_, u_lobe, u);
    if (!sample || !(sample->pdf > 0.0f)) return std::nullopt;
    ScatterSample out{*sample};
    if (!guide_) return out;
    // A delta lobe has no rival, but is reached less often
    out.bsdf.pdf *= 1.0f - guide_share_;
    if (sample->is_delta) return out;
    const float guide_pdf = guide_->directions.pdf(sample->wi);
    out.bsdf.pdf += guide_share_ * guide_pdf;
    out.expected = guide_->mean * guide_pdf / out.bsdf.pdf;
    return out;
}

std::optional<ScatterSample> DirectionMixture::sample_guide(const Vec2& u) const {
    const guiding::DirectionSample direction = guide_->directions.sample(u);
    const shading::BsdfValue value = bsdf_.evaluate(wo_, direction.wi);
    const Rgb f = value.f();
    if (is_black(f)) return std::nullopt;
    ScatterSample out;
    out.bsdf.wi = direction.wi;
    out.bsdf.f = f;
    out.bsdf.kind = value.kind;
    out.bsdf.eta = value.eta;
    out.bsdf.pdf = guide_share_ * direction.pdf + (1.0f - guide_share_) * value.pdf;
    out.expected = guide_->mean * direction.pdf / out.bsdf.pdf;
    return out;
}

}  // namespace velatura::integrator
