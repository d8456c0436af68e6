// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/noise/noise.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// The noise of a mix as it becomes known: from some strips of the image first, then from more
/// and more of them. What is shown is that of the rows so far, which for all of them is what
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
    void advance(const LayerStack& stack, const mix::MixPlan& plan, const Look& look);

    /// Share of the parts that went in.
    double share() const { return double(done_) / double(parts_); }

    double rendered() const { return sum_.rendered().value; }  ///< √relMSE with every gain at 1

    double mix() const { return sum_.mix().value; }  ///< √relMSE of the mix

    /// Of the squared error, largest first; empty where the stored layers do not tell.
    std::vector<noise::RowNoise> groups() const { return sum_.groups(); }

    std::vector<noise::RowNoise> bounces() const { return sum_.bounces(); }

    std::vector<noise::RowNoise> lobes() const { return sum_.lobes(); }

    /// Why there is none: no half images.
    const std::string& error() const { return error_; }

  private:
    size_t parts_ = 1, done_ = 0;
    int rows_ = 1;  ///< of a part
    noise::NoiseSum sum_;
    std::string error_;
};

/// Rows [first, end) of a file as a file of their own.
image::Image rows_of(const image::Image& image, int first, int end);

/// The plan for them: with the same rows of its mattes. width: of the whole file.
mix::MixPlan rows_of(const mix::MixPlan& plan, int width, int first, int end);

}  // namespace velatura::compositor::window
