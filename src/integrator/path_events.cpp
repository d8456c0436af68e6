// SPDX-License-Identifier: Apache-2.0
#include "integrator/path_events.h"

#include <algorithm>
#include <array>

namespace velatura::integrator {

using film::EventShares;
using film::PathEvent;
using shading::ScatterKind;

namespace {

struct Portion {
    PathEvent event;
    Rgb value;  ///< not negative
};

double& channel(accumulate::Triple& t, int c) {
    return c == 0 ? t.x : c == 1 ? t.y : t.z;
}

/// Parts of their sum; where there is nothing, all of it is the last.
template <size_t count>
EventShares shares_of(const std::array<Portion, count>& portions) {
    std::array<accumulate::Triple, count> shares = {};
    for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (const Portion& p : portions) sum += double(p.value[c]);
        for (size_t i = 0; i < count; ++i) {
            const double nothing = i + 1 == count ? 1.0 : 0.0;
            channel(shares[i], c) = sum > 0 ? double(portions[i].value[c]) / sum : nothing;
        }
    }
    EventShares out;
    for (size_t i = 0; i < count; ++i)
        if (!shares[i].is_zero()) out.add(portions[i].event, shares[i]);
    return out;
}

}  // namespace

EventShares events_of(const shading::BsdfValue& value, const lights::LobeMultipliers& multipliers) {
    const Rgb diffuse = value.diffuse * multipliers.diffuse;
    if (value.kind == ScatterKind::Transmit)
        return shares_of<2>(
            {{{PathEvent::DiffuseTransmission, diffuse},
              {PathEvent::GlossyTransmission, value.specular * multipliers.specular}}});
    Rgb below_coat;
    for (int c = 0; c < 3; ++c) below_coat[c] = std::max(value.specular[c] - value.coat, 0.0f);
    return shares_of<3>({{{PathEvent::Diffuse, diffuse},
                          {PathEvent::GlossyCoat, Rgb(value.coat) * multipliers.specular},
                          {PathEvent::Glossy, below_coat * multipliers.specular}}});
}

EventShares events_of(const shading::BsdfSample& sample) {
    if (sample.kind == ScatterKind::Transmit) return EventShares::only(PathEvent::Refraction);
    return EventShares::only(sample.is_coat ? PathEvent::MirrorCoat : PathEvent::Mirror);
}

EventShares events_of(ScatterKind kind, const Rgb& coat) {
    if (kind == ScatterKind::Transmit) return EventShares::only(PathEvent::Refraction);
    return shares_of<2>({{{PathEvent::MirrorCoat, coat}, {PathEvent::Mirror, Rgb(1.0f) - coat}}});
}

}  // namespace velatura::integrator
