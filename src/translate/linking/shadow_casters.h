// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <string>
#include <vector>

namespace velatura::translate::linking {

/// State of this module: which casters are wanted; see TranslateOptions.
struct CasterChoice {
    bool is_wanted = false;
    std::vector<std::string> patterns;
};

/// Names what casts shadows, if that is wanted; once everything is placed. The name is that of
/// `velatura:shadow:caster` on the prim or the nearest of its ancestors, else that of the outermost
/// component, else that of a prim that CasterTree finds. Instances go by their path below the
/// instance; what a point instancer places by its prototype's path and, where that tells nothing,
/// its own.
void find_casters(Context& ctx);

}  // namespace velatura::translate::linking
