// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layered_image.h"
#include "compositor/mix/layered_plan.h"

namespace velatura::compositor::mix {

/// The parts and channels of a mix with layers, without values: those of the file that the mix
/// stores, layers that were black and are lit now, and the beauty where channels of it are missing.
/// Refers to `plan`.
LayeredImage make_layered_image(const LayeredPlan& plan);

}  // namespace velatura::compositor::mix
