// SPDX-License-Identifier: Apache-2.0
#include "view/film_levels.h"

#include "layers/layer_image.h"

#include <utility>

namespace velatura::view {

using compositor::LayerStack;
using compositor::window::Levels;

Result<std::shared_ptr<const Levels>> film_levels(const film::Film& film,
                                                  const film::FileInfo& info,
                                                  int reduction,
                                                  const image::Window& frame) {
    auto image = layers::make_layer_image(film.sums(), info, false);
    if (!image) return image.error();
    auto stack = LayerStack::from_image(std::move(image->image));
    if (!stack) return stack.error();
    auto levels = Levels::make_draft(std::make_shared<const LayerStack>(std::move(*stack)),
                                     reduction, frame.width(), frame.height());
    if (!levels) return levels.error();
    return std::make_shared<const Levels>(std::move(*levels));
}

}  // namespace velatura::view
