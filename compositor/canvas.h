// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::compositor {

/// A display-referred picture to put smaller ones and words on.
class Canvas {
  public:
    using Colour = std::array<float, 3>;  ///< [0, 1]

    static constexpr int text_height = 16;  ///< of a line, pixels

    Canvas(int width, int height, const Colour& background);

    int width() const { return width_; }

    int height() const { return height_; }

    const std::vector<float>& rgb() const { return rgb_; }  ///< [height][width][3]

    /// What lies outside is cut off.
    void fill(int x, int y, int width, int height, const Colour& colour);
    /// rgb: [height][width][3].
    void paste(int x, int y, int width, int height, const std::vector<float>& rgb);
    /// One line of ASCII, upper left corner at (x, y), cut off after `width` pixels.
    void write(int x, int y, int width, std::string_view text, const Colour& colour);

    static int text_width(std::string_view text);

  private:
    int width_, height_;
    std::vector<float> rgb_;
};

}  // namespace velatura::compositor
