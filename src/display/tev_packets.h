// SPDX-License-Identifier: Apache-2.0
// Messages that the viewer tev takes on its TCP port. Numbers are little endian; a message begins
// with its length as uint32, itself included, and a byte for what it is; texts end with a zero.
// Ref: Müller, "tev" (https://github.com/Tom94/tev), src/Ipc.cpp: CreateImage, UpdateImageV3.
#pragma once

#include "image/window.h"

#include <string>
#include <vector>

namespace velatura::display {

/// A packet as it is sent.
using Bytes = std::vector<char>;

/// Makes the viewer show an image of this name, black, in place of one that it has.
/// Args: width, height in pixels; channels: `R`, `G`, `b1.R` …
Bytes create_image(const std::string& name,
                   int width,
                   int height,
                   const std::vector<std::string>& channels);

/// Replaces the pixels of a window.
/// Args: window in pixels of the image, origin top left; values: [height][width][channel].
Bytes update_image(const std::string& name,
                   const image::Window& window,
                   const std::vector<std::string>& channels,
                   const std::vector<float>& values);

}  // namespace velatura::display
