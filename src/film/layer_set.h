// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_set.h"
#include "image/window.h"

namespace velatura::film {

/// Defined beside the EXR contract, because the compositor merges files without the renderer.
using accumulate::LayerSet;
using accumulate::LightGroup;
using image::Window;

}  // namespace velatura::film
