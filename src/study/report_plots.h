// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/plots.h"
#include "study/report.h"

#include <string>
#include <vector>

namespace velatura::study {

/// Error against time, of all settings or of those of one knob.
struct ReportPlot {
    std::string name;  ///< as part of a file's name
    std::string title;
    std::vector<PlotCurve> curves;
    std::vector<std::string> notes;  ///< [curve] beside its label

    PlotDrawing drawing() const { return log_plot(curves); }
};

/// All settings first, then knob by knob as the rows of the table stand; only those with something
/// to draw.
std::vector<ReportPlot> report_plots(const Report& report);

/// An image of 1200 pixels' width with title and key, as PNG.
std::string to_png(const ReportPlot& plot);

}  // namespace velatura::study
