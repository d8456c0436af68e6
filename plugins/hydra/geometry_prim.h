// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/scene_records.h"

#include <pxr/imaging/hd/rprim.h>
#include <pxr/imaging/hd/sceneDelegate.h>

namespace velatura::hydra {

/// A mesh, basis curves, points, a quadric or a volume, which is authored anew after every change.
class GeometryPrim final : public PXR_NS::HdRprim {
  public:
    /// Args: type: of HdPrimTypeTokens, one of geometry_types().
    GeometryPrim(const PXR_NS::TfToken& type, const PXR_NS::SdfPath& id, SceneRecords& records);

    PXR_NS::HdDirtyBits GetInitialDirtyBitsMask() const override;
    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits,
              const PXR_NS::TfToken& repr) override;
    void Finalize(PXR_NS::HdRenderParam* param) override;
    const PXR_NS::TfTokenVector& GetBuiltinPrimvarNames() const override;

  protected:
    PXR_NS::HdDirtyBits _PropagateDirtyBits(PXR_NS::HdDirtyBits bits) const override;
    void _InitRepr(const PXR_NS::TfToken& repr, PXR_NS::HdDirtyBits* dirty_bits) override;

  private:
    bool is_light(PXR_NS::HdSceneDelegate& delegate) const;
    AuthoredPrim author(PXR_NS::HdSceneDelegate& delegate) const;
    void author_mesh(PXR_NS::HdSceneDelegate& delegate, AuthoredPrim& prim) const;
    void author_curves(PXR_NS::HdSceneDelegate& delegate, AuthoredPrim& prim) const;
    void author_volume(PXR_NS::HdSceneDelegate& delegate, AuthoredPrim& prim) const;
    void author_primvars(PXR_NS::HdSceneDelegate& delegate, AuthoredPrim& prim) const;

    PXR_NS::TfToken type_;
    SceneRecords& records_;
};

const PXR_NS::TfTokenVector& geometry_types();

}  // namespace velatura::hydra
