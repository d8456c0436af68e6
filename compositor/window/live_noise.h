// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/layer_stack.h"
#include "compositor/noise.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// The noise of a mix as it becomes known: from every k-th row of the picture first, then from more
/// and more of them. What is shown is the mean over the rows so far, which for all of them is what
/// forecast_noise says of the whole file.
class LiveNoise {
  public:
    explicit LiveNoise(const LayerStack& stack);

    /// Parts that the work is cut into, all about as long.
    size_t part_count() const { return parts_; }

    /// Forgets what was found for another mix.
    void begin();

    bool is_done() const { return done_ == parts_ || !error_.empty(); }

    /// Takes up one more part; the plan is that of the look.
    void advance(const LayerStack& stack, const MixPlan& plan, const Look& look);

    /// Share of the rows that went in.
    double share() const { return double(done_) / double(parts_); }

    double rendered() const;  ///< √relMSE with every gain at 1
    double mix() const;       ///< √relMSE of the mix
    /// Of the squared error, largest first; empty where the stored layers do not tell.
    std::vector<RowNoise> groups() const;
    std::vector<RowNoise> bounces() const;

    /// Why there is none: no half images.
    const std::string& error() const { return error_; }

  private:
    size_t parts_ = 1, done_ = 0;
    double pixels_ = 0, rendered_ = 0, mix_ = 0;  ///< sums of squares times pixels
    std::vector<RowNoise> groups_, bounces_;      ///< shares times those of the mix
    std::string error_;
};

/// Rows first, first + step, … of a file as a file of their own.
image::Image every_nth_row(const image::Image& image, size_t first, size_t step);

/// The plan for them: with the same rows of its mattes. window: of the whole file.
MixPlan every_nth_row(const MixPlan& plan, const image::Window& window, size_t first, size_t step);

}  // namespace velatura::compositor::window
