// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/path_event.h"
#include "lights/light_set.h"
#include "shading/bsdf.h"

namespace velatura::integrator {

/// What f does, of a light that counts by the multipliers.
film::EventShares events_of(const shading::BsdfValue& value,
                            const lights::LobeMultipliers& multipliers = {});

/// Of a delta lobe that was drawn.
film::EventShares events_of(const shading::BsdfSample& sample);

/// Of all delta lobes of a kind together; coat: what of each channel the coat reflects, [0, 1].
film::EventShares events_of(shading::ScatterKind kind, const Rgb& coat);

}  // namespace velatura::integrator
