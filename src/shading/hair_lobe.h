// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/hair.h"

#include <optional>

namespace velatura::shading {

/// A fiber as a scattering function of a surface. The path loop multiplies by the cosine to the
/// normal, which means nothing to a fiber: f is divided by it.
struct HairLobe {
    HairLobes lobes;
    HairLobes::View view;  ///< of the constructor's wo

    /// wo, wi: render space.
    BsdfValue evaluate(const HairLobes::View& from,
                       const Frame& frame,
                       const Vec3& wo,
                       const Vec3& wi) const {
        BsdfValue value;
        const float factor = abs_dot(wi, frame.z);
        if (!(factor > 0.0f)) return value;
        const HairLobes::Value scattered = lobes.evaluate(from, frame.to_local(wi));
        value.specular = scattered.f_cosine / factor;
        value.pdf = scattered.pdf;
        const bool passes = (wi.dot(frame.z) > 0.0f) != (wo.dot(frame.z) > 0.0f);
        value.kind = passes ? ScatterKind::Transmit : ScatterKind::Reflect;
        return value;
    }

    std::optional<BsdfSample> sample(const HairLobes::View& from,
                                     const Frame& frame,
                                     const Vec3& wo,
                                     float u_lobe,
                                     const Vec2& u) const {
        BsdfSample s;
        s.wi = renormalize(frame.from_local(lobes.sample(from, u_lobe, u)));
        const BsdfValue value = evaluate(from, frame, wo, s.wi);
        if (!(value.pdf > 0.0f)) return std::nullopt;
        s.f = value.f();
        s.pdf = value.pdf;
        s.kind = value.kind;
        return s;
    }
};

}  // namespace velatura::shading
