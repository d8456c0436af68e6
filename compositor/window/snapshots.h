// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/look/controls.h"
#include "compositor/window/levels.h"
#include "compositor/window/worker.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// An image as it was shown at a moment: its layers, its look, and a small image of both.
struct Snapshot {
    uint64_t number = 0;  ///< from 1, of this window
    std::string title;    ///< `snapshot 2`
    std::string note;     ///< `64 spp`
    std::shared_ptr<const Levels> levels;
    Look look;
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;  ///< [height][width][4] of the small image
};

/// The last snapshots, the newest at the end.
class Snapshots {
  public:
    /// Each holds the layers of an image in memory; one more drops the oldest.
    static constexpr size_t max_count = 8;

    /// Of an image as the worker would show it.
    const Snapshot& add(const ImageTask& task);

    void remove(size_t index) { all_.erase(all_.begin() + std::ptrdiff_t(index)); }

    const std::vector<Snapshot>& all() const { return all_; }

  private:
    std::vector<Snapshot> all_;
    uint64_t last_ = 0;
};

}  // namespace velatura::compositor::window
