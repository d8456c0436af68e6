// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "compositor/mix/mix_plan.h"

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// Lays a mixed image over a plate, premultiplied: image + plate · (1 − A) · L, where L is 1 beside
/// the catchers of the file, and on them the sum of gain · `catcher_<group>` over `plate`, channel
/// by channel. The gain of a group is that of its direct light; mattes of a look do not reach the
/// plate, its exposure does. The plate is a scene-linear EXR of the size of the image, in whatever
/// color space it says. What it asks for and cannot have is added to `warnings`.
/// Errors: "plate" (another size, no colors, not linear), "io-open", "io-read", "unknown-space".
Result<void> lay_on_plate(image::Image& mixed,
                          const layers::StripReader& file,
                          const LayerStack& layout,
                          const MixPlan& plan,
                          const Look& look,
                          const std::string& plate,
                          size_t strip_bytes,
                          std::vector<std::string>& warnings);

}  // namespace velatura::compositor::mix
