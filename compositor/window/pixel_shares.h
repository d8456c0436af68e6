// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "compositor/mix/mix_plan.h"

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// What each row has of the light at a pixel.
struct PixelShares {
    std::array<int, 2> pixel = {0, 0};     ///< of the image
    std::map<std::string, double> shares;  ///< by row; 1 is the mix without solos

    /// 0 where it is not known.
    double of(const std::string& row) const;

    /// Rows with more light first; `all` and `env` stay where they are. Equal ones keep their
    /// order.
    std::vector<std::string> sorted(std::vector<std::string> rows) const;
};

/// By luminance: what the mix shows with this row soloed, over what it shows without solos.
/// Args: pixel: of the stack. plan: the plan of a look, with its mattes.
PixelShares shares_at(const LayerStack& stack,
                      const Look& look,
                      const std::vector<std::string>& rows,
                      const std::array<int, 2>& pixel,
                      const std::function<Result<mix::MixPlan>(const Look&)>& plan);

}  // namespace velatura::compositor::window
