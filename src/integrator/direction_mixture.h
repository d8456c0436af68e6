// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guiding/guiding_field.h"
#include "sampling/sampler.h"
#include "shading/bsdf.h"

#include <cstdint>
#include <optional>

namespace velatura::integrator {

/// A direction in which a path goes on.
struct ScatterSample {
    shading::BsdfSample bsdf;  ///< pdf is that of the mixture
    /// What the path may expect to bring per unit of throughput before the scattering, given the
    /// direction: learned f · cosθ · Li / pdf as a luminance. 0 = not known.
    float expected = 0;
};

/// How one vertex chooses where its path goes on: by its BSDF, or also by what was learned about
/// where light comes from, as one sample of a mixture. Without a learned density it is the BSDF's
/// own sampling, bit for bit.
class DirectionMixture {
  public:
    /// guide: may be null. bsdf and guide must outlive the mixture; p in render space.
    DirectionMixture(const shading::Bsdf& bsdf,
                     const Vec3& wo,
                     const Vec3& p,
                     const guiding::GuidingField* guide)
        : bsdf_(bsdf), wo_(wo) {
        if (guide) set_guide(p, *guide);
    }

    /// [1/sr] over all non-delta directions, given the BSDF's own density of wi.
    float pdf(const Vec3& wi, float bsdf_pdf) const {
        if (!guide_) return bsdf_pdf;
        return guide_share_ * guide_->directions.pdf(wi) + (1.0f - guide_share_) * bsdf_pdf;
    }

    /// nullopt: the path is absorbed.
    std::optional<ScatterSample> sample(const sampling::PixelSampler& sampler,
                                        int bounce,
                                        uint32_t repeat) const;

    /// What going on may expect to bring per unit of throughput, whatever the direction; 0 = not
    /// known.
    float expected() const { return guide_ ? guide_->mean : 0.0f; }

  private:
    void set_guide(const Vec3& p, const guiding::GuidingField& guide);
    std::optional<ScatterSample> sample_guide(const Vec2& u) const;

    const shading::Bsdf& bsdf_;
    Vec3 wo_;
    std::optional<guiding::Guide> guide_;
    float guide_share_ = 0;  ///< of the samples
};

}  // namespace velatura::integrator
