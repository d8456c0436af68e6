// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator_factory.h"
#include "base/diagnostics.h"

#include <optional>
#include <string>

namespace velatura::render {

/// What `--accel NAME` stands for: nullptr for the own tree ("bvh"), which opens no plugin. Nothing
/// when no plugin brings the name or it cannot be loaded, which is reported: somebody who compares
/// accelerators must not get the own one instead.
std::optional<const accel::AcceleratorFactory*> find_accelerator(const std::string& name,
                                                                 Diagnostics& diagnostics);

}  // namespace velatura::render
