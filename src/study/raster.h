// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/plots.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace velatura::study {

/// Draws plots as pixels, in the colors of the page by day: lines and dots by the coverage that
/// their distance gives, letters by image/pixel_font.h.
class Raster {
  public:
    Raster(int width, int height);

    /// Moved by dx, dy, then scaled; letters keep their height of about 16 pixels.
    void draw(const PlotDrawing& drawing, double scale, double dx, double dy);

    int width() const { return width_; }

    int height() const { return height_; }

    const std::vector<float>& rgb() const {
        return rgb_;
    }  ///< display-referred, [height][width][3]

  private:
    using Color = std::array<float, 3>;
    using Point = std::pair<double, double>;

    void blend(int x, int y, const Color& color, double coverage);
    void draw_segment(const Point& a, const Point& b, double width, const Color& color);
    void draw_line(const std::vector<Point>& points,
                   double width,
                   bool is_dashed,
                   const Color& color);
    void draw_text(const Point& at, const PlotDrawing::Text& text, const Color& color);

    int width_, height_;
    std::vector<float> rgb_;
};

}  // namespace velatura::study
