// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator_factory.h"

#include <memory>

namespace velatura::plugins::embree {

/// Embree 3 in robust mode. README.md says where its hits may differ from those of the own tree.
class EmbreeFactory final : public accel::AcceleratorFactory {
  public:
    Result<std::unique_ptr<accel::Accelerator>> build(const accel::SoupScene& scene) const override;
};

}  // namespace velatura::plugins::embree
