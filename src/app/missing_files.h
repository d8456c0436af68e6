// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "usd/stage/stage.h"

#include <cstddef>

namespace velatura::app {

/// Files that textures, lights and volume fields of a stage name.
struct NamedFiles {
    size_t count = 0, missing = 0;
};

/// Looks for each of them without reading it, where AssetRoots admits it, and reports the missing
/// ones at the attribute with the codes of a render. Prims that no renderer traverses are skipped;
/// materials count whether or not a prim is bound to them.
NamedFiles report_missing_files(const usd::stage::Stage& stage,
                                usd::stage::TimeCode time,
                                Diagnostics& diagnostics);

}  // namespace velatura::app
