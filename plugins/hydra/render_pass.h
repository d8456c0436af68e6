// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/render_loop.h"

#include <pxr/imaging/hd/renderPass.h>
#include <pxr/imaging/hd/renderPassState.h>

namespace velatura::hydra {

class RenderPass final : public PXR_NS::HdRenderPass {
  public:
    RenderPass(PXR_NS::HdRenderIndex* index,
               const PXR_NS::HdRprimCollection& collection,
               const SceneRecords& records,
               RenderLoop& loop);

    bool IsConverged() const override;

  protected:
    void _Execute(const PXR_NS::HdRenderPassStateSharedPtr& state,
                  const PXR_NS::TfTokenVector& render_tags) override;

  private:
    const SceneRecords& records_;
    RenderLoop& loop_;
    PXR_NS::HdRenderPassAovBindingVector bindings_;
    RenderBuffer own_color_;  ///< of hosts that bind nothing
    bool has_job_ = false;

    // Of the last job
    const PXR_NS::HdCamera* camera_ = nullptr;
    int camera_version_ = 0, scene_version_ = 0;
    unsigned int settings_version_ = 0;
    PXR_NS::GfMatrix4d projection_ = PXR_NS::GfMatrix4d(1.0);
    film::Window window_;
    int width_ = 0, height_ = 0;
    PXR_NS::TfTokenVector tags_;
};

}  // namespace velatura::hydra
