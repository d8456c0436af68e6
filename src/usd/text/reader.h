// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"

#include <memory>
#include <string>
#include <string_view>

namespace velatura::usd::text {

/// Rules that files outside the standard need.
struct TextOptions {
    /// Lets references, payloads, inherits and specializes name paths with variant selections, as
    /// old files do.
    bool allow_variants_in_arc_paths = false;
};

/// Reads a text layer (.usda). What is wrong goes into `diagnostics` with file:line:column; a layer
/// with errors is no layer (Error "usd-parse"), but reading goes on to report as much as it can.
/// Every spec and field keeps its place; relative target, connection and arc paths come out
/// absolute. Ref: AOUSD Core Specification 1.0.1, 16.2, with the legacy rules of 16.2.19.
Result<std::shared_ptr<layer::Layer>> read_text_layer(std::string_view bytes,
                                                      std::string identifier,
                                                      Diagnostics& diagnostics,
                                                      const TextOptions& options = {});

}  // namespace velatura::usd::text
