// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::canvas {

/// A display-referred image to put smaller ones, lines and words on. What lies outside is cut off.
class Canvas {
  public:
    using Color = std::array<float, 3>;  ///< [0, 1]
    using Point = std::pair<double, double>;

    static constexpr int text_height = 16;  ///< of a line, pixels

    Canvas(int width, int height, const Color& background);

    int width() const { return width_; }

    int height() const { return height_; }

    const std::vector<float>& rgb() const { return rgb_; }  ///< [height][width][3]

    void fill(int x, int y, int width, int height, const Color& color);
    /// rgb: [height][width][3].
    void paste(int x, int y, int width, int height, const std::vector<float>& rgb);
    /// One line of ASCII, upper left corner at (x, y), cut off after `width` pixels.
    void write(int x, int y, int width, std::string_view text, const Color& color);
    /// One line of ASCII whose base line begins at (x, y); turned left, it runs upward.
    void write_along(int x, int y, std::string_view text, bool is_turned, const Color& color);
    /// From a to b with round ends, by the coverage that the distance of a pixel gives.
    void draw_segment(const Point& a, const Point& b, double width, const Color& color);

    static int text_width(std::string_view text);

  private:
    void blend(int x, int y, const Color& color, double coverage);

    int width_, height_;
    std::vector<float> rgb_;
};

}  // namespace velatura::canvas
