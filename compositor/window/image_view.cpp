// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/image_view.h"

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

namespace {

constexpr double smallest_scale = 1.0 / 64, largest_scale = 64;

}  // namespace

void ImageView::set_area(int width, int height) {
    area_ = {std::max(width, 1), std::max(height, 1)};
}

void ImageView::set_image(int width, int height) {
    const std::array<int, 2> image = {std::max(width, 1), std::max(height, 1)};
    if (image == image_) return;
    image_ = image;
    fit();
}

double ImageView::fit_scale() const {
    const double fitting = std::min(double(area_[0]) / image_[0], double(area_[1]) / image_[1]);
    // A small image is not blown up to mush
    return std::clamp(fitting, smallest_scale, std::max(1.0, std::floor(fitting)));
}

double ImageView::scale() const {
    return is_fit_ ? fit_scale() : scale_;
}

ImageView::Point ImageView::origin() const {
    const double s = scale();
    Point origin{};
    for (size_t i = 0; i < 2; ++i) {
        const double center = is_fit_ ? image_[i] / 2.0 : center_[i];
        origin[i] = std::round(area_[i] / 2.0 - center * s);
    }
    return origin;
}

ImageView::Point ImageView::image_at(const Point& screen) const {
    const Point o = origin();
    return {(screen[0] - o[0]) / scale(), (screen[1] - o[1]) / scale()};
}

image::Window ImageView::visible() const {
    const Point low = image_at({0, 0}), high = image_at({double(area_[0]), double(area_[1])});
    return {std::clamp(int(std::floor(low[0])), 0, image_[0]),
            std::clamp(int(std::floor(low[1])), 0, image_[1]),
            std::clamp(int(std::ceil(high[0])), 0, image_[0]),
            std::clamp(int(std::ceil(high[1])), 0, image_[1])};
}

void ImageView::fit() {
    is_fit_ = true;
}

void ImageView::set_scale(double scale) {
    zoom_at({area_[0] / 2.0, area_[1] / 2.0}, scale / this->scale());
}

void ImageView::zoom_at(const Point& screen, double factor) {
    const Point under = image_at(screen);
    scale_ = std::clamp(scale() * factor, smallest_scale, largest_scale);
    // Close to 1:1 is meant to be 1:1
    if (std::abs(scale_ - 1) < 1e-3) scale_ = 1;
    is_fit_ = false;
    for (size_t i = 0; i < 2; ++i) center_[i] = under[i] + (area_[i] / 2.0 - screen[i]) / scale_;
    scroll_into_view();
}

void ImageView::pan(double dx, double dy) {
    if (is_fit_) {
        scale_ = fit_scale();
        center_ = {image_[0] / 2.0, image_[1] / 2.0};
        is_fit_ = false;
    }
    center_[0] -= dx / scale_;
    center_[1] -= dy / scale_;
    scroll_into_view();
}

void ImageView::scroll_into_view() {
    for (size_t i = 0; i < 2; ++i) center_[i] = std::clamp(center_[i], 0.0, double(image_[i]));
}

}  // namespace velatura::compositor::window
