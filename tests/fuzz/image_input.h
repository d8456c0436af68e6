// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <string>
#include <string_view>

namespace velatura::fuzz {

/// Pixels that an image has at most in each direction.
inline constexpr int max_pixels = 8;

/// The image that bytes stand for, any bytes: width and height, then attributes ('A' name 0 text
/// 0) and channels of integers
/// ('U' name 0, four bytes for every pixel) or floats ('F' likewise); what the end cuts off is 0.
image::Image image_of(std::string_view bytes);

/// The other way, for text attributes and channels of integers and floats of one part.
std::string bytes_of(const image::Image& image);

}  // namespace velatura::fuzz
