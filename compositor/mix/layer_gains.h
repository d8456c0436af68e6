// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layered_image.h"
#include "compositor/mix/layered_plan.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// Applies the gains of a mix to the layers of an image, whose values are finite: the operations of
/// a mix without layers, in its order, so that the layers add up to the same beauty bit for bit.
class LayerGains {
  public:
    /// Refers to `image` and its plan.
    explicit LayerGains(LayeredImage& image) : image_(image), plan_(image.plan()) {}

    /// Of a file of ours: all layers, and the beauty.
    void apply();
    /// Of a file of another renderer: its rows, and the beauty where the file has one; else returns
    /// the beauty that the rows add up to.
    std::array<Values, 3> apply_to_rows();
    /// The layer `variance`, after the others, from the common gain or from the half images.
    void set_variance();

  private:
    void gain_family(const MixPlan::Term& term, const LayerChannel& own);
    void gain_shadow(const accumulate::LayerEntry& shadow, const LayerChannel& own);
    void gain_clamp(const accumulate::LayerEntry& clamp, const LayerChannel& own);
    void gain_beside();
    void add_up(const std::vector<std::string>& layers, const LayerChannel& sum);
    Values gained(const MixPlan::Term& term, const Values& values, size_t c) const;
    std::vector<std::string> casters_of(const accumulate::LayerEntry& shadow) const;

    LayeredImage& image_;
    const LayeredPlan& plan_;
};

}  // namespace velatura::compositor::mix
