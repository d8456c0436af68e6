// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/report.h"

#include <string>
#include <vector>

namespace velatura::study {

/// The table of knobs from the results of the settings: what to look at first comes first.
std::vector<KnobRow> make_rows(const Report& report,
                               const std::vector<Knob>& knobs,
                               const Facts& facts);

/// What to add to the options of the render to follow a row; empty: it advises nothing.
std::string advised_options(const Report& report, const KnobRow& row);

/// A relative number as people read it: "1.42 %".
std::string percent(double value);
/// A difference of percentages: "-0.40 pp".
std::string points(double value);
/// "12.4 s", "3.1 min", "2.4 h".
std::string duration(double seconds);
std::string signed_duration(double seconds);

/// The cells of the table.
struct RowText {
    std::string knob, now, leaves, cost, next, buys, costs, verdict, advice;
};

RowText text_of(const Report& report, const KnobRow& row);

}  // namespace velatura::study
