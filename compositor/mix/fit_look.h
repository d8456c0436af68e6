// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// A look without what the file lacks.
struct FittedLook {
    Look look;
    std::vector<std::string> omitted;  ///< one line for each control or row, with the reason
};

/// Takes out of a look, made for another shot perhaps, every control that this file cannot follow
/// beside those before it. What is left can be mixed. All stay where all together can be followed.
/// `file` and `strip_bytes` as for plan_mix.
FittedLook fit_look(const LayerStack& stack,
                    const Look& look,
                    const layers::StripReader* file = nullptr,
                    size_t strip_bytes = size_t(1) << 30);

}  // namespace velatura::compositor::mix
