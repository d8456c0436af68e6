// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/mix_plan.h"
#include "compositor/window/shown_layers.h"

#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// A file at its own size and at halves, quarters … of it, for mixes at the size of the screen.
class Levels {
  public:
    /// Errors: "too-large" (an image of more pixels than the window can cut into tiles).
    static Result<Levels> make(std::shared_ptr<const LayerStack> stack);
    /// A draft of an image of width x height pixels: a pixel of the stack covers `reduction` x
    /// `reduction` of them, at the right and lower edge fewer. Errors: as above.
    static Result<Levels> make_draft(std::shared_ptr<const LayerStack> stack,
                                     int reduction,
                                     int width,
                                     int height);

    size_t count() const { return stacks_.size(); }

    /// Level 0 is the file; a pixel of level k covers 2^k × 2^k of its.
    const LayerStack& stack(size_t level) const { return *stacks_[level]; }

    /// Full names of the channels with NaN or infinite values.
    const std::set<std::string>& not_finite() const { return not_finite_; }

    /// What of the file can be looked at by itself.
    const std::vector<ShownLayer>& shown() const { return shown_; }

    /// The whole image at that level; x0 = y0 = 0.
    image::Window frame(size_t level) const;

    /// The whole image in its own pixels, of which a draft has fewer; x0 = y0 = 0.
    const image::Window& image_frame() const { return image_frame_; }

    /// Pixels of the image along a side of one of level 0: 1, but for drafts.
    int reduction() const { return reduction_; }

    /// The smallest level that still has a pixel for each of the screen; scale: pixels of the
    /// screen per pixel of the image.
    size_t level_for(double scale) const;
    /// The first one that is mixed at once, whatever the machine.
    size_t quick_level() const;

  private:
    std::vector<std::shared_ptr<const LayerStack>> stacks_;
    std::set<std::string> not_finite_;
    std::vector<ShownLayer> shown_;
    image::Window image_frame_;
    int reduction_ = 1;
};

/// Reads a file with or without a header of Velatura, or several of one AOV each. `view`: of a
/// stereo file, empty takes the first. Errors: those of LayerStack::load, load_input and
/// Levels::make.
Result<std::shared_ptr<const Levels>> load_levels(const std::vector<std::string>& paths,
                                                  const std::string& view);

using LevelPlans = std::vector<std::shared_ptr<const mix::MixPlan>>;

/// A plan for each level: the same, but for the mattes, which are as small as the level. Those that
/// a plan of `earlier` has too are taken from it.
LevelPlans plans_by_level(const Levels& levels,
                          mix::MixPlan plan,
                          std::span<const LevelPlans> earlier = {});

/// Half the size: the mean of 2 × 2 pixels of everything that is shown, in the type it is
/// stored in, of integers the first; pixels that the file does not store are black. The display
/// window starts at 0, 0.
image::Image half_size(const LayerStack& stack);

}  // namespace velatura::compositor::window
