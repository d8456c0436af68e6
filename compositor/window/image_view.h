// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/window.h"

#include <array>

namespace velatura::compositor::window {

/// Which part of an image is seen, and how large. Screen positions count in pixels of the screen
/// from the top left of the area that shows the image; an image's pixel (x, y) is the square
/// [x, x+1) × [y, y+1). The image's origin lies on a whole pixel of the screen, so that at 1:1
/// each of its pixels is one of the screen.
class ImageView {
  public:
    using Point = std::array<double, 2>;

    void set_area(int width, int height);
    /// Fits the image in, unless it has the size of the one before.
    void set_image(int width, int height);

    bool is_fit() const { return is_fit_; }

    /// Pixels of the screen per pixel of the image.
    double scale() const;
    /// Where the image's top left corner is on the screen.
    Point origin() const;
    Point image_at(const Point& screen) const;

    /// What is seen, in whole pixels of the image.
    image::Window visible() const;

    void fit();
    /// 1:1 (or any other scale) about the middle of the area.
    void set_scale(double scale);
    /// What lies under the point stays there.
    void zoom_at(const Point& screen, double factor);
    void pan(double dx, double dy);

  private:
    double fit_scale() const;
    void scroll_into_view();

    std::array<int, 2> area_ = {1, 1}, image_ = {1, 1};
    bool is_fit_ = true;
    double scale_ = 1;
    Point center_ = {0, 0};  ///< position in the image that is in the middle of the area
};

}  // namespace velatura::compositor::window
