// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// A layer of the file that can be looked at by itself: AOVs, light layers, data.
struct ShownLayer {
    std::string name;
    size_t part = 0;
    /// Full names of what is shown as red, green, blue and alpha; empty: not stored. A layer of one
    /// channel is shown as gray: three times the same name.
    std::array<std::string, 4> channels = {};

    bool operator==(const ShownLayer&) const = default;
};

/// Those of the file in its order, `rgba` (the beauty as stored) first, half images last.
std::vector<ShownLayer> shown_layers(const LayerStack& stack);

}  // namespace velatura::compositor::window
