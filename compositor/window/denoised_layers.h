// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/jobs.h"
#include "compositor/window/levels.h"

#include <functional>
#include <memory>
#include <optional>
#include <utility>

namespace velatura::compositor::window {

/// All layers denoised by the filter of `velatura-comp denoise`, as a draft of one pixel for
/// 2^level x 2^level of the image. Level 0 holds what the command writes. Errors: those of
/// denoise::denoise.
Result<std::shared_ptr<const Levels>> denoised_levels(const Levels& levels, size_t level);

/// Denoises the layers that are shown, in the background: first at a size that takes little time,
/// and at full size once they stay. Newer layers wait until those under way are done.
class DenoisedLayers {
  public:
    /// `wake` is called from another thread whenever there is news.
    explicit DenoisedLayers(std::function<void()> wake) : jobs_(std::move(wake)) {}

    /// The newest layers as they were rendered.
    void offer(std::shared_ptr<const Levels> levels);

    /// Begins what is due. stays: no newer layers are on their way.
    void advance(bool stays);

    /// What came since the last call. Errors: why these layers cannot be denoised.
    std::optional<Result<std::shared_ptr<const Levels>>> take();

    /// Begins anew with the next offer().
    void clear();

    /// Something is being denoised.
    bool is_busy() const { return jobs_.is_busy(); }

    /// What was offered last is denoised at full size, or cannot be.
    bool is_done() const { return is_done_; }

  private:
    Jobs<std::shared_ptr<const Levels>> jobs_;
    std::shared_ptr<const Levels> newest_;  ///< null: none was offered
    std::shared_ptr<const Levels> begun_;   ///< what the last job is of
    bool is_begun_whole_ = false;           ///< it is at full size
    bool is_done_ = true;
};

}  // namespace velatura::compositor::window
