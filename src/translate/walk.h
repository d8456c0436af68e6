// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/placeable.h"

namespace velatura::translate {

/// Walks the subtree of `prim` whose parent has the given matrix (absolute, before the origin is
/// subtracted).
void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, Placeable& out);
/// Walks what stands below `prim`, which has the given matrix, by names.
void walk_children(Context& ctx, Prim prim, const Mat4d& matrix, Placeable& out);

}  // namespace velatura::translate
