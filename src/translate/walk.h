// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

namespace velatura::translate {

/// Walks the subtree of `prim` whose parent has the given matrix (absolute, before the origin is
/// subtracted).
void walk(Context& ctx, Prim prim, const Mat4d& parent_matrix, InstanceSource& out);
/// Walks what stands below `prim`, which has the given matrix, by names.
void walk_children(Context& ctx, Prim prim, const Mat4d& matrix, InstanceSource& out);

}  // namespace velatura::translate
