// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layered_image.h"
#include "compositor/mix/mix.h"

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// NaN and infinite values of the layers that a mix gains.
class NotFiniteLayers {
  public:
    /// Replaces them by 0. What is gained becomes floats.
    void clear(LayeredImage& image);

    /// By layer: how many there were, and the first.
    const std::map<std::string, NotFiniteLayer>& found() const { return found_; }

  private:
    void clear(const std::string& layer, const image::Window& data, image::Channel& channel);
    void note(const NotFiniteLayer& found);

    std::mutex mutex_;
    std::map<std::string, NotFiniteLayer> found_;
};

/// Values that gains took beyond floats, in whatever layer of a mix.
std::optional<NotFiniteLayer> find_overflow(LayeredImage& image);

}  // namespace velatura::compositor::mix
