// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::guiding {

/// Where light is wanted.
struct Place {
    Vec3 p;  ///< render space
    Vec3 n;  ///< unit normal on the side of the viewer
};

/// What a path brought to one of its vertices through the direction it took there.
struct Record {
    Place at;
    Vec3 wi;           ///< unit, away from the surface
    float weight = 0;  ///< luminance of f · cosθ · Li / pdf, Li without what light sampling found
};

}  // namespace velatura::guiding
