// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/layer/value.h"

namespace velatura::usd::crate {

/// The array that `rep` stands for. Where it lies plain and aligned in the file its elements are
/// the file's bytes; else they are decoded on first use, by one thread. What can be told without
/// decoding is checked here; data that turns out corrupt on first use is reported then, and its
/// elements are zeros. `is_shared`: other values may ask for the same array, as samples do. False
/// with the problem when there is no array.
bool read_array(
    const CrateFilePtr& file, ValueRep rep, bool is_shared, layer::Value& out, Problem& problem);

}  // namespace velatura::usd::crate
