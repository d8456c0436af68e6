// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/scene_records.h"

#include <pxr/imaging/hd/field.h>
#include <pxr/imaging/hd/instancer.h>
#include <pxr/imaging/hd/light.h>
#include <pxr/imaging/hd/material.h>

namespace velatura::hydra {

// What is not geometry, authored anew after every change.

class MaterialPrim final : public PXR_NS::HdMaterial {
  public:
    MaterialPrim(const PXR_NS::SdfPath& id, SceneRecords& records)
        : HdMaterial(id), records_(records) {}

    PXR_NS::HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }

    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits) override;

    void Finalize(PXR_NS::HdRenderParam*) override { records_.remove(GetId()); }

  private:
    SceneRecords& records_;
};

class LightPrim final : public PXR_NS::HdLight {
  public:
    /// Args: type: of HdPrimTypeTokens, one of light_types().
    LightPrim(const PXR_NS::TfToken& type, const PXR_NS::SdfPath& id, SceneRecords& records)
        : HdLight(id), type_(type), records_(records) {}

    PXR_NS::HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }

    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits) override;

    void Finalize(PXR_NS::HdRenderParam*) override { records_.remove(GetId()); }

  private:
    PXR_NS::TfToken type_;
    SceneRecords& records_;
};

const PXR_NS::TfTokenVector& light_types();

class InstancerPrim final : public PXR_NS::HdInstancer {
  public:
    InstancerPrim(PXR_NS::HdSceneDelegate* delegate,
                  const PXR_NS::SdfPath& id,
                  SceneRecords& records)
        : HdInstancer(delegate, id), records_(records) {}

    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits) override;

    void Finalize(PXR_NS::HdRenderParam* param) override;

  private:
    void read_primvars(PXR_NS::HdSceneDelegate& delegate);

    SceneRecords& records_;
    InstancerRecord record_;
};

/// An OpenVDB grid of a file.
class FieldPrim final : public PXR_NS::HdField {
  public:
    FieldPrim(const PXR_NS::SdfPath& id, SceneRecords& records) : HdField(id), records_(records) {}

    PXR_NS::HdDirtyBits GetInitialDirtyBitsMask() const override { return AllDirty; }

    void Sync(PXR_NS::HdSceneDelegate* delegate,
              PXR_NS::HdRenderParam* param,
              PXR_NS::HdDirtyBits* dirty_bits) override;

    void Finalize(PXR_NS::HdRenderParam*) override { records_.remove(GetId()); }

  private:
    SceneRecords& records_;
};

}  // namespace velatura::hydra
