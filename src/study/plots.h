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

/// Both axes by logarithms, as SVG to stand in a page; its colors are the page's variables --c0 … --c6, --grid and --text.
/// x and y are told in seconds and shares (1 = 100 %).
std::string log_plot(const std::vector<PlotCurve>& curves, const std::string& title);

/// Text that can stand between tags or in an attribute.
std::string escaped(const std::string& text);

}  // namespace velatura::study
