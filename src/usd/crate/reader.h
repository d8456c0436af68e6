// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"

#include <memory>
#include <string>

namespace velatura::usd::crate {

/// Reads a binary layer (.usdc), versions 0.0.1 to 0.14: the same Layer that its text form gives.
/// Values know their file but no line. Arrays and time samples are brought in when they are used
/// and keep the bytes alive until then; plain aligned arrays are the bytes themselves. Thread-safe.
/// A value that is corrupt is left out, with an error that names its place; a corrupt structure
/// costs the layer: Error "usd-crate". Data found corrupt on first use is reported to `diagnostics`
/// if it still exists. Limits: a table holds at most two million items plus one per byte of the
/// file; copies and decoded arrays take at most limits().array_bytes plus 1024 bytes per byte of
/// the file.
Result<std::shared_ptr<layer::Layer>> read_crate_layer(const AssetBytesPtr& bytes,
                                                       const std::string& identifier,
                                                       Diagnostics& diagnostics);

}  // namespace velatura::usd::crate
