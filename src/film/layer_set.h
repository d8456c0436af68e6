// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/layer_set.h"
#include "image/window.h"

namespace velatura::film {

/// Defined beside the EXR contract, because the compositor merges files without the renderer.
using image::LayerSet;
using image::LightGroup;
using image::Window;

}  // namespace velatura::film
