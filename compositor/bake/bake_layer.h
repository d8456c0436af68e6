// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/bake/bake.h"

#include <string>

namespace velatura::compositor::bake {

/// A USD layer (.usda) of `over` prims with the baked opinions; what is left out stands in it as
/// comments. `source` names the file of the mix. Errors: "bad-prim-path" (a path of the file's
/// header is none of USD).
Result<std::string> bake_layer_text(const Bake& bake, const std::string& source);

/// The stage metadata of a .usda layer, between its parentheses, without sublayers and relocates:
/// what a layer on top has to repeat, since only the root layer's count. Empty when it has none.
/// Errors: "not-usda".
Result<std::string> stage_metadata(const std::string& usda);

/// A root layer whose sublayers are `stronger` and, below it, `weaker` (file names), with that
/// metadata.
std::string stacked_layer_text(const std::string& stronger,
                               const std::string& weaker,
                               const std::string& metadata);

}  // namespace velatura::compositor::bake
