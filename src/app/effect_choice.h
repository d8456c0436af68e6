// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "integrator/effect_plan.h"
#include "scene/effect.h"

#include <string>

namespace velatura::app {

/// What `--effects` asks for.
struct EffectChoice {
    bool force_all = false;    ///< all effects that can run without being called for do
    scene::EffectSet omitted;  ///< as if no prim called for them
};

/// Reads `all`, `-name` or several of them apart by commas. Errors: "usage".
Result<EffectChoice> parse_effects(const std::string& text);

}  // namespace velatura::app
