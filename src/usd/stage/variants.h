// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/stage.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// Names of the variants that a set of the prim offers, sorted; empty when it has no such set.
std::vector<std::string> variant_names(const Prim& prim, std::string_view set);

}  // namespace velatura::usd::stage
