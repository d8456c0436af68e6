// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

#include <cstdint>
#include <map>

namespace velatura::compositor::window {

/// The snapshots side by side. Uses the current OpenGL context.
class SnapshotStrip {
  public:
    SnapshotStrip() = default;
    ~SnapshotStrip();
    SnapshotStrip(const SnapshotStrip&) = delete;
    SnapshotStrip& operator=(const SnapshotStrip&) = delete;

    /// Height of its panel; 0: there are none.
    static float height(const Session& session);

    void draw(Drawing& drawing);

  private:
    unsigned texture_of(const Snapshot& snapshot);

    std::map<uint64_t, unsigned> textures_;  ///< by number
};

}  // namespace velatura::compositor::window
