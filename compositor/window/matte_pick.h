// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "layers/cryptomatte.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// Something that a Cryptomatte has at a pixel.
struct PickedObject {
    std::string layer;  ///< `CryptoObject`
    std::string name;   ///< empty: the manifest does not have it
    uint32_t id = 0;
    float coverage = 0;

    /// `/World/vase 75 %`.
    std::string text() const;
};

/// The Cryptomattes of a file, with their names.
class MattePicker {
  public:
    MattePicker() = default;
    explicit MattePicker(const LayerStack& stack);

    /// Layers that can be picked from; empty: the file has no Cryptomatte whose ids can be read.
    const std::vector<std::string>& layers() const { return layers_; }

    /// What a layer has at a pixel of the image, counted from its top left; most coverage first.
    std::vector<PickedObject> at(const LayerStack& stack,
                                 const std::string& layer,
                                 int x,
                                 int y) const;

  private:
    std::vector<layers::Cryptomatte> mattes_;
    std::vector<std::string> layers_;
};

/// The matte of these names, as `--matte` reads it: names hold whatever they hold. Empty: none.
std::string matte_text(const std::string& layer, std::span<const std::string> names);

}  // namespace velatura::compositor::window
