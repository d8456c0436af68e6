// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"
#include "usd/stage/stage.h"

#include <string>

namespace velatura::usd::stage {

/// The composed facts of a stage, one per line: what `velatura info --dump` prints. Format: USD.md
/// §9. The errors collected in the stage's diagnostics close the text as COMPERR lines.
std::string dump_stage(const Stage& stage);

/// One value in the dump's notation.
std::string dump_value(const layer::Value& value);

}  // namespace velatura::usd::stage
