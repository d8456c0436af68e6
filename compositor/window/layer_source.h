// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/levels.h"

#include <memory>
#include <optional>
#include <string>

namespace velatura::compositor::window {

/// Layers that take the place of those that are shown.
struct RenewedLayers {
    std::shared_ptr<const Levels> levels;
    /// Another camera or scene: what is on the screen is replaced at once, coarse parts first. Else
    /// tiles stay until theirs are mixed, so that an image that converges does not flicker.
    bool is_other_image = false;
};

/// Layers that are renewed while the window shows them: those of a file that is replaced, or of a
/// render under way. Called by the window's thread.
class LayerSource {
  public:
    LayerSource() = default;
    virtual ~LayerSource() = default;
    LayerSource(const LayerSource&) = delete;
    LayerSource& operator=(const LayerSource&) = delete;

    /// What came since the last call, the newest only.
    /// Errors: why there are no new layers; those that are shown stay.
    virtual std::optional<Result<RenewedLayers>> take() = 0;

    /// What the status line states while nothing failed: `following shot.exr`.
    virtual std::string state() const = 0;

    /// No layers are on their way.
    virtual bool is_settled() const { return true; }
};

}  // namespace velatura::compositor::window
