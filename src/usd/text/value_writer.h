// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <string>

namespace velatura::usd::text {

/// Appends a scalar, array, path, word or block; what has no such form (dictionaries, list-ops) is
/// left to the writer of layers.
void append_value(std::string& out, const layer::Value& value);

}  // namespace velatura::usd::text
