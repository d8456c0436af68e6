// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"
#include "layers/layer_header.h"

#include <map>
#include <string>
#include <vector>

namespace velatura::layers {

/// Channels of a file by light layer: `b0` → b0.R b0.G b0.B, `rgba` → R G B A; bookkeeping left
/// out.
std::map<std::string, std::vector<const image::Channel*>> channels_by_layer(
    const image::Image& image);

/// What a check of a file found.
struct LayerCheck {
    std::vector<std::string> problems;   ///< empty = the file keeps its promises
    std::vector<FamilyClosure> closure;  ///< as the header has it, with what was measured now
    int layers = 0, channels = 0;

    bool is_good() const { return problems.empty(); }
};

/// Checks from the file alone: header strings, names, presence, finite values, closure (bit for bit
/// for the finest family, within the rounding bound for the others), and the digest of every layer.
/// Problems name the first offending pixel or the layer.
LayerCheck check_layers(const image::Image& image, const LayerHeader& header);

}  // namespace velatura::layers
