// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace velatura::study {

/// A curve of a plot. Coordinates above zero.
struct PlotCurve {
    std::string label;
    int color = 0;  ///< 0: the color of text, for the render as it is; 1 … 6
    std::vector<std::pair<double, double>> points;
    std::vector<std::string> hints = {};  ///< of the points, shown where a mouse rests on them
    bool is_dots = false;                 ///< points that have nothing between them
    bool is_dashed = false;
};

/// What a plot is drawn of, in the order in which it is drawn. Coordinates from the upper left
/// corner.
struct PlotDrawing {
    static constexpr int grid_color = -1, text_color = -2;

    struct Line {
        std::vector<std::pair<double, double>> points;
        int color = grid_color;  ///< of a curve, or one of those above
        double width = 1;
        bool is_dashed = false;
    };

    struct Dot {
        double x = 0, y = 0, radius = 1;
        int color = 0;
        std::string hint;
    };

    enum class Anchor { Start, Middle, End };

    struct Text {
        double x = 0, y = 0;  ///< on its base line
        std::string content;
        Anchor anchor = Anchor::Start;
        bool is_upright = false;  ///< read from below
        int color = text_color;
    };

    double width = 0, height = 0;
    std::vector<Line> lines;
    std::vector<Dot> dots;
    std::vector<Text> texts;

    bool is_empty() const { return lines.empty(); }
};

/// Both axes by logarithms; x and y are told in seconds and shares (1 = 100 %). Empty where there
/// is no point.
PlotDrawing log_plot(const std::vector<PlotCurve>& curves);

/// To stand in a page; its colors are the page's variables --c0 … --c6, --grid and --soft.
std::string to_svg(const PlotDrawing& drawing, const std::string& title);

}  // namespace velatura::study
