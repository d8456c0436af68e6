// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"
#include "layers/layer_header.h"

#include <string>
#include <vector>

namespace velatura::compositor {

/// A file of layers made by hand: 2 groups × (b0 b1 tail) as floats, S_<group> and its casters
/// `tree` and `rest`, clamp layers of some cells. Values are functions of pixel and name.
image::Image made_layers();

/// Layers of made_layers() as black ones: named in the header and not stored.
void take_out(image::Image& image, const std::vector<std::string>& layers);

/// One value of a made layer.
float made_value(const std::string& channel, size_t pixel);

/// An image of channels with made values and without any header of Velatura, in parts by name.
image::Image made_foreign(
    const std::vector<std::pair<std::string, std::vector<std::string>>>& parts);

}  // namespace velatura::compositor
