// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/stack_color.h"

namespace velatura::compositor {
inline namespace look {

Result<image::FileColor> color_of_stack(const LayerStack& stack, const Look& look) {
    return image::color_of(stack.image(), look.input_space, stack.beauty_part());
}

}  // namespace look
}  // namespace velatura::compositor
