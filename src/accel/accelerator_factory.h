// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "accel/bvh.h"
#include "base/result.h"

#include <cstdint>
#include <memory>

namespace velatura::accel {

/// Under this name and version a plugin hands out a `const AcceleratorFactory*`. The version
/// changes whenever this header or a type that it mentions does.
inline constexpr const char* accelerator_interface = "accelerator";
inline constexpr uint32_t accelerator_interface_version = 5;

/// Builds accelerators of another kind than build_bvh.
class AcceleratorFactory {
  public:
    virtual ~AcceleratorFactory() = default;

    /// Must not throw. The triangles need not outlive the call. Errors: "accelerator", when there
    /// is not enough memory or a library refuses.
    virtual Result<std::unique_ptr<Accelerator>> build(const SoupScene& scene) const = 0;
};

}  // namespace velatura::accel
