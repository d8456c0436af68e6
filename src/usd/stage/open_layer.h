// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"
#include "usd/stage/stage.h"

#include <memory>

namespace velatura::usd::stage {

/// Opens and composes a root layer that is in memory, such as one of a layer::LayerBuilder. It must
/// not change while the Stage is used. The stage's root_file() is the layer's identifier.
/// Args: options: its made_layer must be null.
Result<Stage> open_layer(std::shared_ptr<layer::Layer> root,
                         StageOptions options,
                         Diagnostics& diagnostics);

}  // namespace velatura::usd::stage
