// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/render_settings.h"

#include <pxr/imaging/hd/engine.h>
#include <pxr/imaging/hd/pluginRenderDelegateUniqueHandle.h>
#include <pxr/imaging/hd/renderBuffer.h>
#include <pxr/imaging/hd/renderIndex.h>
#include <pxr/imaging/hd/renderPass.h>
#include <pxr/imaging/hd/renderPassState.h>
#include <pxr/imaging/hd/task.h>
#include <pxr/usd/usd/stage.h>
#include <pxr/usdImaging/usdImaging/delegate.h>
#include <pxr/usdImaging/usdImaging/sceneIndices.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace velatura::hydra {

/// How a host feeds the render index.
enum class Frontend { SceneDelegate, SceneIndex };

/// What is read back from an AOV: rows from the top.
struct AovImage {
    int width = 0, height = 0;
    size_t components = 0;
    std::vector<float> floats;
    std::vector<int32_t> ints;
};

/// A program that renders a stage through the plugin, as usdview does, without a window.
class Host {
  public:
    Host(PXR_NS::UsdStageRefPtr stage,
         Frontend frontend,
         const PXR_NS::SdfPath& camera,
         int width,
         int height,
         const HostSettings& settings,
         std::vector<std::string> aovs = {"color"});
    ~Host();

    /// Sends what changed of the stage, and runs the pass once.
    void step();

    /// Steps until the pass has converged.
    void finish();

    void set_camera(const PXR_NS::SdfPath& camera) { camera_ = camera; }

    AovImage read(const std::string& aov);

    PXR_NS::HdRenderIndex& index() { return *index_; }

    PXR_NS::HdRenderDelegate& delegate() { return *delegate_; }

    bool is_converged() const { return pass_->IsConverged(); }

  private:
    PXR_NS::UsdStageRefPtr stage_;
    PXR_NS::SdfPath camera_;
    int width_, height_;
    std::vector<std::string> aovs_;
    PXR_NS::HdPluginRenderDelegateUniqueHandle delegate_;
    std::unique_ptr<PXR_NS::HdRenderIndex> index_;
    std::unique_ptr<PXR_NS::UsdImagingDelegate> imaging_;
    PXR_NS::UsdImagingSceneIndices scene_indices_;
    std::vector<PXR_NS::HdRenderBuffer*> buffers_;
    PXR_NS::HdRenderPassSharedPtr pass_;
    PXR_NS::HdRenderPassStateSharedPtr state_;
    PXR_NS::HdEngine engine_;
    PXR_NS::HdTaskSharedPtrVector tasks_;
};

}  // namespace velatura::hydra
