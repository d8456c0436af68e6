// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pxr/imaging/hd/rendererPlugin.h>
#include <pxr/pxr.h>

PXR_NAMESPACE_OPEN_SCOPE

/// What hosts find by plugInfo.json.
class HdVelaturaRendererPlugin final : public HdRendererPlugin {
  public:
    HdRenderDelegate* CreateRenderDelegate() override;
    HdRenderDelegate* CreateRenderDelegate(const HdRenderSettingsMap& settings) override;
    void DeleteRenderDelegate(HdRenderDelegate* delegate) override;
    bool IsSupported(bool has_gpu) const override;
};

PXR_NAMESPACE_CLOSE_SCOPE
