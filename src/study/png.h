// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace velatura::study {

/// A PNG file of display-referred RGB (image::display_byte), [height][width][3], row 0 = top.
std::string to_png(int width, int height, const std::vector<float>& rgb);

}  // namespace velatura::study
