// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/dyadic_sum.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace velatura::film {

/// What a scattering does, as light path expressions tell it apart
/// (docs/reference/light_path_expressions.md).
enum class PathEvent : uint8_t {
    Diffuse,
    Subsurface,
    Glossy,
    Mirror,
    GlossyCoat,
    MirrorCoat,
    DiffuseTransmission,
    GlossyTransmission,
    Refraction,
    Volume,
};

inline constexpr size_t path_event_count = size_t(PathEvent::Volume) + 1;

/// Whether the diffuse multipliers of lights are for it, or the specular ones.
constexpr bool is_diffuse(PathEvent event) {
    return event == PathEvent::Diffuse || event == PathEvent::Subsurface ||
           event == PathEvent::DiffuseTransmission || event == PathEvent::Volume;
}

/// What parts of a scattering are what: shares that add up to 1 in each channel.
struct EventShares {
    struct Share {
        PathEvent event;
        accumulate::Triple share;
    };

    std::array<Share, 3> shares = {};
    size_t count = 0;

    void add(PathEvent event, const accumulate::Triple& share) { shares[count++] = {event, share}; }

    static EventShares only(PathEvent event) {
        EventShares all;
        all.add(event, {1.0, 1.0, 1.0});
        return all;
    }

    const Share* begin() const { return shares.data(); }

    const Share* end() const { return shares.data() + count; }
};

}  // namespace velatura::film
