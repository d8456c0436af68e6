// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

namespace velatura::translate::motion {

/// Whether a prim that is no mesh changes its shape while the shutter is open.
bool changes_shape(Context& ctx, Prim prim, Prim frame);

/// Names a prim whose motion is not rendered, be it carried or deformed.
void warn_if_it_moves(Context& ctx, Prim prim, Prim frame);

/// Names a prim that is no mesh and changes its shape.
void warn_if_it_deforms(Context& ctx, Prim prim, Prim frame);

}  // namespace velatura::translate::motion
