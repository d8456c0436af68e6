// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pxr/imaging/hd/sceneIndexPlugin.h>
#include <pxr/pxr.h>

PXR_NAMESPACE_OPEN_SCOPE

/// Lets OpenUSD's scene index of light linking run for this renderer: from collections of lights to
/// categories of prims, as the scene delegate has them.
class HdVelatura_LightLinkingSceneIndexPlugin final : public HdSceneIndexPlugin {
  protected:
    HdSceneIndexBaseRefPtr _AppendSceneIndex(const HdSceneIndexBaseRefPtr& scene,
                                             const HdContainerDataSourceHandle& args) override;
};

PXR_NAMESPACE_CLOSE_SCOPE
