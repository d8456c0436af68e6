// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// What is stored, and what the mix makes of it, at one pixel.
struct PixelReadout {
    struct Layer {
        std::string name;
        std::array<float, 3> stored{};
        /// Exposure, mattes and shares of clamps included: what the layers store times their gains
        /// adds up to the mix. 0 where the mix does not use the layer.
        std::array<float, 3> gain{};
    };

    struct Data {
        std::string name;  ///< `N`, `Z`
        std::vector<float> values;
    };

    int x = 0, y = 0;  ///< from the top left of the image
    std::array<float, 3> mix{};
    float alpha = 1;
    std::vector<Layer> layers;  ///< those that the mix adds up, as it folds them, then all others
    std::vector<Data> data;
};

/// "0.25 1.5": values of a data layer; ids and counts with all their digits, "none" for the id of
/// nothing (4294967295 in the file).
std::string data_text(const std::vector<float>& values);

/// x, y within the image; what is not stored there is 0.
PixelReadout read_pixel(
    const LayerStack& stack, const mix::MixPlan& plan, float exposure_stops, int x, int y);

}  // namespace velatura::compositor::window
