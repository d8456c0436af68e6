// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/render_pass.h"

#include "plugins/hydra/camera_prim.h"

#include <pxr/base/gf/rect2i.h>
#include <pxr/base/tf/diagnostic.h>
#include <pxr/imaging/cameraUtil/conformWindow.h>
#include <pxr/imaging/hd/renderDelegate.h>
#include <pxr/imaging/hd/renderIndex.h>
#include <pxr/imaging/hd/tokens.h>

#include <cmath>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

std::string conform_policy(CameraUtilConformWindowPolicy policy) {
    switch (policy) {
        case CameraUtilCrop:
            return "cropAperture";
        case CameraUtilMatchHorizontally:
            return "adjustApertureHeight";
        case CameraUtilMatchVertically:
            return "adjustApertureWidth";
        case CameraUtilDontConform:
            return "adjustPixelAspectRatio";
        default:
            return "expandAperture";
    }
}

/// Size of the image and the pixels of it that are wanted.
void set_frame(const HdRenderPassState& state, RenderJob& job) {
    const CameraUtilFraming& framing = state.GetFraming();
    if (!framing.IsValid()) {
        const GfVec4f viewport = state.GetViewport();
        job.width = int(viewport[2]);
        job.height = int(viewport[3]);
        job.window = {0, 0, job.width, job.height};
        return;
    }
    const GfRange2f& display = framing.displayWindow;
    job.width = int(std::lround(display.GetSize()[0]));
    job.height = int(std::lround(display.GetSize()[1]));
    job.pixel_aspect_ratio = framing.pixelAspectRatio;
    const int left = int(std::lround(display.GetMin()[0]));
    const int top = int(std::lround(display.GetMin()[1]));
    const GfRect2i& data = framing.dataWindow;
    job.window = {data.GetMinX() - left, data.GetMinY() - top, data.GetMaxX() + 1 - left,
                  data.GetMaxY() + 1 - top};
    job.frame.left = data.GetMinX();
    job.frame.top = data.GetMinY();
}

}  // namespace

RenderPass::RenderPass(HdRenderIndex* index,
                       const HdRprimCollection& collection,
                       const SceneRecords& records,
                       RenderLoop& loop)
    : HdRenderPass(index, collection),
      records_(records),
      loop_(loop),
      own_color_(SdfPath::EmptyPath(),
                 [&loop](const RenderBuffer& buffer) { loop.detach(buffer); }) {}

bool RenderPass::IsConverged() const {
    if (!has_job_) return true;
    for (const HdRenderPassAovBinding& binding : bindings_)
        if (binding.renderBuffer && !binding.renderBuffer->IsConverged()) return false;
    return true;
}

void RenderPass::_Execute(const HdRenderPassStateSharedPtr& state,
                          const TfTokenVector& render_tags) {
    const auto* const camera = dynamic_cast<const CameraPrim*>(state->GetCamera());
    if (!camera) {
        TF_WARN("velatura: a render pass without a camera prim renders nothing");
        return;
    }
    RenderJob job;
    set_frame(*state, job);
    if (job.width < 1 || job.height < 1 || job.window.width() < 1 || job.window.height() < 1)
        return;
    const HdRenderDelegate& delegate = *GetRenderIndex()->GetRenderDelegate();
    HdRenderPassAovBindingVector bindings = state->GetAovBindings();
    if (bindings.empty()) {
        if (int(own_color_.GetWidth()) != job.width || int(own_color_.GetHeight()) != job.height) {
            own_color_.Allocate(GfVec3i(job.width, job.height, 1), HdFormatFloat32Vec4, false);
            has_job_ = false;
        }
        HdRenderPassAovBinding color;
        color.aovName = HdAovTokens->color;
        color.renderBuffer = &own_color_;
        bindings.push_back(color);
    }
    job.scene_version = records_.version();
    const GfMatrix4d projection = state->GetProjectionMatrix();
    const bool is_same = has_job_ && loop_.has_job() && bindings == bindings_ &&
                         camera == camera_ && camera->version() == camera_version_ &&
                         job.scene_version == scene_version_ &&
                         delegate.GetRenderSettingsVersion() == settings_version_ &&
                         projection == projection_ && job.window == window_ &&
                         job.width == width_ && job.height == height_ && render_tags == tags_;
    if (is_same) return;
    bindings_ = bindings;
    camera_ = camera;
    camera_version_ = camera->version();
    scene_version_ = job.scene_version;
    settings_version_ = delegate.GetRenderSettingsVersion();
    projection_ = projection;
    window_ = job.window;
    width_ = job.width;
    height_ = job.height;
    tags_ = render_tags;
    has_job_ = true;

    job.render_tags = render_tags;
    job.camera = camera->prim();
    job.camera_path = to_path(camera->GetId()).to_string();
    job.aspect_conform = conform_policy(state->GetWindowPolicy());
    job.settings = read_settings(delegate);
    job.frame.projection = projection;
    job.frame.eye_from_world = state->GetWorldToViewMatrix();
    for (const HdRenderPassAovBinding& binding : bindings_)
        if (binding.renderBuffer)
            static_cast<RenderBuffer*>(binding.renderBuffer)->set_converged(false);
    job.bindings = std::move(bindings);
    loop_.start(std::move(job));
}

}  // namespace velatura::hydra
