// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::integrator {

/// What was traced; one per task, added up at its end.
struct RayCounts {
    uint64_t camera = 0;
    uint64_t indirect = 0;
    uint64_t shadow = 0;
    uint64_t paths = 0;
    uint64_t depth_limited = 0;  ///< paths cut by hard_depth_limit

    uint64_t total() const { return camera + indirect + shadow; }

    RayCounts& operator+=(const RayCounts& o) {
        camera += o.camera;
        indirect += o.indirect;
        shadow += o.shadow;
        paths += o.paths;
        depth_limited += o.depth_limited;
        return *this;
    }
};

}  // namespace velatura::integrator
