// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/image_view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::compositor::window {
namespace {

ImageView view_of(int area_w, int area_h, int w, int h) {
    ImageView view;
    view.set_area(area_w, area_h);
    view.set_image(w, h);
    return view;
}

TEST(ImageView, FitsLargeImagesIn) {
    const ImageView view = view_of(800, 600, 1920, 1080);
    EXPECT_NEAR(view.scale(), 800.0 / 1920, 1e-12);
    EXPECT_EQ(view.visible(), (image::Window{0, 0, 1920, 1080}));
    EXPECT_NEAR(view.origin()[0], 0, 1);
    EXPECT_NEAR(view.origin()[1], (600 - 450) / 2, 1);
}

TEST(ImageView, EnlargesSmallImagesByWholeFactors) {
    EXPECT_EQ(view_of(800, 600, 320, 180).scale(), 2);
    EXPECT_EQ(view_of(800, 600, 700, 500).scale(), 1);
}

TEST(ImageView, WhatIsUnderTheMouseStaysThere) {
    ImageView view = view_of(800, 600, 1920, 1080);
    const ImageView::Point mouse = {613, 211};
    for (const double factor : {1.2, 1.7, 3.0, 0.3}) {
        const auto before = view.image_at(mouse);
        view.zoom_at(mouse, factor);
        const auto after = view.image_at(mouse);
        // The origin goes to a whole pixel
        EXPECT_NEAR(after[0], before[0], 0.51 / view.scale());
        EXPECT_NEAR(after[1], before[1], 0.51 / view.scale());
    }
}

TEST(ImageView, OneToOneLiesOnPixels) {
    ImageView view = view_of(801, 603, 1920, 1080);
    for (int i = 0; i < 7; ++i) view.zoom_at({317, 333}, 1.2);
    view.set_scale(1);
    EXPECT_EQ(view.scale(), 1);
    view.pan(13, -7);
    for (const double o : view.origin()) EXPECT_EQ(o, std::round(o));
    EXPECT_EQ(view.visible().width(), 801);
}

TEST(ImageView, PanMovesByPixelsOfTheScreen) {
    ImageView view = view_of(800, 600, 1920, 1080);
    view.set_scale(2);
    const auto before = view.origin();
    view.pan(30, -12);
    EXPECT_EQ(view.origin()[0], before[0] + 30);
    EXPECT_EQ(view.origin()[1], before[1] - 12);
}

TEST(ImageView, TheImageCannotBeLost) {
    ImageView view = view_of(800, 600, 1920, 1080);
    view.pan(1e6, 1e6);
    EXPECT_FALSE(view.visible().is_empty());
    view.zoom_at({0, 0}, 1e-9);
    EXPECT_GT(view.scale(), 0);
    view.zoom_at({0, 0}, 1e9);
    EXPECT_LT(view.scale(), 1000);
}

TEST(ImageView, AFileOfTheSameSizeKeepsTheView) {
    ImageView view = view_of(800, 600, 1920, 1080);
    view.set_scale(1);
    view.set_image(1920, 1080);
    EXPECT_EQ(view.scale(), 1);
    view.set_image(960, 540);
    EXPECT_TRUE(view.is_fit());
}

}  // namespace
}  // namespace velatura::compositor::window
