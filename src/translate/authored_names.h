// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "usd/stage/stage.h"

namespace velatura::translate {

/// Warns about what a stage authors and no render reads: names near to those of its schemas,
/// unknown types, transform ops that are missing or not listed, attributes of other renderers, and
/// attributes of the schemas that are not supported. Once per name, with the number of prims.
void report_authored_names(const usd::stage::Stage& stage, Diagnostics& diagnostics);

}  // namespace velatura::translate
