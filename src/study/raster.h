// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "canvas/canvas.h"
#include "study/plots.h"

namespace velatura::study {

/// What plots are drawn on, in the colors of the page by day.
canvas::Canvas plot_paper(int width, int height);

/// Draws a plot as pixels, moved by dx, dy, then scaled; letters keep their height of about 16
/// pixels.
void draw_plot(
    canvas::Canvas& canvas, const PlotDrawing& drawing, double scale, double dx, double dy);

}  // namespace velatura::study
