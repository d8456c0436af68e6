// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/report.h"

#include <vector>

namespace velatura::study {

/// A scene-linear value as displays take it, in [0, 1].
float encoded(double linear);

/// Adds the mean image, where its noise is and where its time goes, and how much of either is in
/// few pixels.
void add_maps(Report& report,
              const Reference& reference,
              const std::vector<Setting>& settings,
              const Tallies& tallies);

}  // namespace velatura::study
