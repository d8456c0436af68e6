// SPDX-License-Identifier: Apache-2.0
#include "compositor/stack_color.h"

namespace velatura::compositor {

Result<image::FileColor> color_of_stack(const LayerStack& stack, const Look& look) {
    return image::color_of(stack.image(), look.input_space, stack.beauty_part());
}

}  // namespace velatura::compositor
