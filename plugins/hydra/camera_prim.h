// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/authored_prim.h"

#include <pxr/imaging/hd/camera.h>

namespace velatura::hydra {

/// A camera, with those parameters that HdCamera does not keep.
class CameraPrim final : public PXR_NS::HdCamera {
  public:
    explicit CameraPrim(const PXR_NS::SdfPath& id) : HdCamera(id) {}

    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits) override;

    /// Its prim, in world space.
    const AuthoredPrim& prim() const { return prim_; }

    /// Counts changes.
    int version() const { return version_; }

  private:
    AuthoredPrim prim_{"Camera"};
    int version_ = 0;
};

}  // namespace velatura::hydra
