// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

namespace velatura::translate {

/// Warns about a prim type that is seen and not rendered.
void warn_unsupported(Context& ctx, Prim prim);
/// Names a prim without geometry of its own that LightAPI or one of its kin is applied to.
void warn_light_without_geometry(Context& ctx, Prim prim);
/// Names curves and points that are to be lights themselves.
void warn_round_light(Context& ctx, Prim prim);
/// Names features of rendered prims that are not honored.
void warn_unsupported_features(Context& ctx, Prim prim);

}  // namespace velatura::translate
