// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/crate/crate_format.h"
#include "usd/layer/layer.h"

#include <string>

namespace velatura::usd::crate {

struct CrateWriteOptions {
    /// Version to begin with, 0.4 to 0.13; content that needs a newer one gets it.
    Version version{0, 9, 0};
};

/// The bytes of a .usdc file that reads back as the same layer; equal layers give equal bytes.
/// Tables and arrays are compressed, equal values stored once, plain arrays aligned so that readers
/// can map them. What the format has no type for (a relationship's default, say) is left out with a
/// warning "usd-crate-unwritable". Error "usd-crate-write" for other versions and for
/// texts with a zero byte, naming the first spec that has one.
Result<std::string> write_crate_layer(const layer::Layer& layer,
                                      Diagnostics& diagnostics,
                                      const CrateWriteOptions& options = {});

}  // namespace velatura::usd::crate
