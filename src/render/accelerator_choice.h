// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator_factory.h"
#include "base/diagnostics.h"

#include <optional>
#include <string>

namespace velatura::render {

/// Accelerator of `--accel NAME`.
/// Returns: nullptr for the built-in BVH ("bvh"), which opens no plugin; nullopt when no plugin
///          provides the name or it cannot be loaded.
/// Errors:  that plugin error, in `diagnostics`. There is no fallback to the built-in BVH: renders
///          that compare accelerators must not use it unnoticed.
std::optional<const accel::AcceleratorFactory*> find_accelerator(const std::string& name,
                                                                 Diagnostics& diagnostics);

}  // namespace velatura::render
