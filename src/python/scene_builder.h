// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer_builder.h"

namespace velatura::python {

/// The scene that a script writes.
struct SceneBuilder {
    usd::layer::LayerBuilder layer;
};

}  // namespace velatura::python
