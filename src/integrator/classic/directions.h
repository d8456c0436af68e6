// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_selector.h"

namespace velatura::integrator::classic {

/// A direction in which a vertex looks for lights.
struct LightDirection {
    Vec3 wi;
    float pdf = 0;  ///< [1/sr]
};

// Over the hemisphere of the receiver's normal, over both where light comes through; uniformly over
// the sphere where there is no normal. u in [0,1)².

LightDirection uniform_direction(const lights::Receiver& from, const Vec2& u);
LightDirection cosine_direction(const lights::Receiver& from, const Vec2& u);

}  // namespace velatura::integrator::classic
