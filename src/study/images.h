// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/report.h"

namespace velatura::study {

/// The part of that size with most noise, by the grid's pixels, each counted by its deviation: one
/// outlier does not decide.
Region noisiest_region(const Report& report, const Tallies& tallies, int width, int height);

/// Adds images of the render as it is and of the settings of the upper rows, of samples that take
/// equal time by what the study found, at most 128 × 96 pixels and as large as `time_s` allows.
/// Nothing where that is too small to look at, or time is up.
void add_images(Report& report,
                const Tallies& tallies,
                const RenderFunction& render,
                double time_s);

}  // namespace velatura::study
