// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"

#include <vector>

namespace velatura::integrator {

/// Who takes how much of a light on its way: the part that surfaces and volumes stop, in the order
/// in which light that comes from the receiver would meet them. What solids absorb inside is
/// nobody's.
class ShadowShares {
  public:
    struct Share {
        scene::CasterId caster;
        Rgb taken;  ///< of the whole light
    };

    void clear() { shares_.clear(); }

    void add(scene::CasterId caster, const Rgb& taken) {
        if (caster != scene::none && !is_black(taken)) shares_.push_back({caster, taken});
    }

    auto begin() const { return shares_.begin(); }

    auto end() const { return shares_.end(); }

  private:
    std::vector<Share> shares_;
};

}  // namespace velatura::integrator
