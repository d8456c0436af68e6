// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/layered_image.h"
#include "compositor/mix/layered_plan.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_plan.h"
#include "image/image.h"
#include "layers/strip_reader.h"

#include <array>
#include <span>
#include <vector>

namespace velatura::compositor::mix {

/// A mix with all layers of its file that still hold (layer_outcomes.h): the parts of the file, the
/// light of each layer gained as in the mix, values that are not finite as 0, and the rest bit for
/// bit. A light layer of halves stays one where no value changes by it. The beauty is the fold of
/// the stored layers, so that mixing the result with unit gains gives it bit for bit.
///
/// A file of another renderer keeps its parts and names, with a beauty R G B where it had none;
/// of several views the one that is mixed is kept, and files that were opened together become parts
/// of one.
///
/// The steps, each with a header: layered_plan.h, layered_parts.h, not_finite_layers.h,
/// layer_gains.h, layered_storage.h, layered_header.h; layered_image.h is what they work on.
class LayeredMix {
  public:
    LayeredMix(const LayerStack& layout, const MixPlan& plan, const Look& look);
    LayeredMix(const LayeredMix&) = delete;
    LayeredMix& operator=(const LayeredMix&) = delete;

    /// What strips must hold.
    std::span<const layers::ChannelRef> channels() const { return image_.channels(); }

    /// Strips may come in any order and from several threads.
    void take(const layers::Strip& strip) { image_.take(strip); }

    /// After all strips, once.
    image::Image image(std::vector<NotFiniteLayer>* not_finite);

  private:
    void replace_copies_of_beauty(const std::array<Values, 3>& rendered);

    const Look& look_;
    LayeredPlan plan_;
    LayeredImage image_;
};

}  // namespace velatura::compositor::mix
