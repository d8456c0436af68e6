// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/render_loop.h"
#include "plugins/hydra/scene_records.h"

#include <pxr/imaging/hd/renderDelegate.h>
#include <pxr/imaging/hd/resourceRegistry.h>

#include <memory>

namespace velatura::hydra {

/// Renders what Hydra gives it, as a stage in memory (docs/reference/hydra.md).
class RenderDelegate final : public PXR_NS::HdRenderDelegate {
  public:
    explicit RenderDelegate(const PXR_NS::HdRenderSettingsMap& settings);

    // Types of prims
    const PXR_NS::TfTokenVector& GetSupportedRprimTypes() const override;
    const PXR_NS::TfTokenVector& GetSupportedSprimTypes() const override;
    const PXR_NS::TfTokenVector& GetSupportedBprimTypes() const override;
    PXR_NS::HdRprim* CreateRprim(const PXR_NS::TfToken& type, const PXR_NS::SdfPath& id) override;
    PXR_NS::HdSprim* CreateSprim(const PXR_NS::TfToken& type, const PXR_NS::SdfPath& id) override;
    PXR_NS::HdSprim* CreateFallbackSprim(const PXR_NS::TfToken& type) override;
    PXR_NS::HdBprim* CreateBprim(const PXR_NS::TfToken& type, const PXR_NS::SdfPath& id) override;
    PXR_NS::HdBprim* CreateFallbackBprim(const PXR_NS::TfToken& type) override;
    PXR_NS::HdInstancer* CreateInstancer(PXR_NS::HdSceneDelegate* delegate,
                                         const PXR_NS::SdfPath& id) override;

    void DestroyRprim(PXR_NS::HdRprim* prim) override;
    void DestroySprim(PXR_NS::HdSprim* prim) override;
    void DestroyBprim(PXR_NS::HdBprim* prim) override;
    void DestroyInstancer(PXR_NS::HdInstancer* instancer) override;

    // Rendering
    PXR_NS::HdRenderPassSharedPtr CreateRenderPass(
        PXR_NS::HdRenderIndex* index, const PXR_NS::HdRprimCollection& collection) override;

    void CommitResources(PXR_NS::HdChangeTracker*) override {}

    PXR_NS::HdResourceRegistrySharedPtr GetResourceRegistry() const override { return resources_; }

    bool IsPauseSupported() const override { return true; }

    bool IsPaused() const override { return loop_.is_paused(); }

    bool Pause() override;
    bool Resume() override;

    bool IsStopSupported() const override { return true; }

    bool IsStopped() const override { return loop_.is_stopped(); }

    bool Stop(bool is_blocking) override;
    bool Restart() override;
    PXR_NS::VtDictionary GetRenderStats() const override;

    // Settings
    PXR_NS::HdRenderSettingDescriptorList GetRenderSettingDescriptors() const override;
    PXR_NS::TfTokenVector GetRenderSettingsNamespaces() const override;
    PXR_NS::HdAovDescriptor GetDefaultAovDescriptor(const PXR_NS::TfToken& name) const override;
    PXR_NS::TfToken GetMaterialBindingPurpose() const override;
    PXR_NS::TfTokenVector GetMaterialRenderContexts() const override;

  private:
    PXR_NS::HdResourceRegistrySharedPtr resources_;
    SceneRecords records_;
    RenderLoop loop_;
};

}  // namespace velatura::hydra
