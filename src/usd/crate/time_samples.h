// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <vector>

namespace velatura::usd::crate {

/// Samples whose ValueReps begin at byte `values_at` of the file, one for each time and known to
/// lie inside; each is read when it is asked for. Sorts the times; of equal ones the last sample
/// wins.
layer::TimeSamples make_time_samples(CrateFilePtr file,
                                     std::vector<double> times,
                                     uint64_t values_at);

}  // namespace velatura::usd::crate
