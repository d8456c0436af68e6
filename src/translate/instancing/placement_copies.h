// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

namespace velatura::translate::instancing {

/// Leaves out, in `content` and in all that is placed in it, each placement that stands exactly
/// where an earlier one puts the same shapes: of surfaces in one place, shining ones too, only the
/// first is seen. Lights without a mesh and volumes in one place add up, so what holds some is
/// kept, and what light linking or casters may tell apart. One warning for all. Before anything is
/// multiplied out: a few lines of copies within copies come to millions.
void omit_copies(Context& ctx, InstanceSource& content);

}  // namespace velatura::translate::instancing
