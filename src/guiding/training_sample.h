// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::guiding {

/// Point where a guiding distribution is queried.
struct GuidingPoint {
    Vec3 p;  ///< render space
    Vec3 n;  ///< unit normal on the side of the viewer
};

/// Training sample of path guiding: incident light at a path vertex from the sampled direction.
struct TrainingSample {
    GuidingPoint at;
    Vec3 wi;           ///< unit, away from the surface
    float weight = 0;  ///< luminance of f · cosθ · Li / pdf, Li without what light sampling found
};

}  // namespace velatura::guiding
