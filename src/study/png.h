// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace velatura::study {

/// A PNG file of display-referred RGB, [height][width][3]. Small pictures only: nothing is compressed.
/// Ref: W3C, Portable Network Graphics, third edition; RFC 1950 and 1951 for stored blocks.
std::string to_png(int width, int height, const std::vector<float>& rgb);

/// RFC 4648.
std::string to_base64(const std::string& bytes);

}  // namespace velatura::study
