// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/volume_set.h"
#include "scene/effect_calls.h"

#include <cstdint>

namespace velatura::integrator {

/// What was traced; one per task, added up at its end.
struct RayCounts {
    uint64_t camera = 0;
    uint64_t indirect = 0;
    uint64_t shadow = 0;
    uint64_t caustic = 0;  ///< segments of photons, see LightTracer, and of specular chains that
                           ///< are solved for, see CausticSampler
    uint64_t in_branches = 0;  ///< of these four: by paths after they had divided
    uint64_t paths = 0;
    uint64_t depth_limited = 0;  ///< paths cut by hard_depth_limit
    uint64_t caustics_found =
        0;  ///< specular chains from a vertex to a light that were found by solving for them
    uint64_t caustics_capped =
        0;  ///< of these: weighed too little, because their probability takes too long to find
    media::TrackingCounts tracking;  ///< through volumes
    uint64_t walks_abandoned = 0;    ///< below surfaces, after SubsurfaceWalk::max_steps
    uint64_t dielectrics_unmatched =
        0;  ///< faces of solids with priorities by which rays left what they had not entered
    uint64_t dielectrics_too_deep =
        0;                       ///< such faces entered within more solids than an Interior holds
    scene::EffectCalls effects;  ///< of the code that traced them; filled by the schedule

    uint64_t total() const { return camera + indirect + shadow + caustic; }

    RayCounts& operator+=(const RayCounts& o) {
        camera += o.camera;
        indirect += o.indirect;
        shadow += o.shadow;
        caustic += o.caustic;
        in_branches += o.in_branches;
        paths += o.paths;
        depth_limited += o.depth_limited;
        caustics_found += o.caustics_found;
        caustics_capped += o.caustics_capped;
        tracking += o.tracking;
        walks_abandoned += o.walks_abandoned;
        dielectrics_unmatched += o.dielectrics_unmatched;
        dielectrics_too_deep += o.dielectrics_too_deep;
        effects += o.effects;
        return *this;
    }
};

}  // namespace velatura::integrator
