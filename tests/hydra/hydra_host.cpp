// SPDX-License-Identifier: Apache-2.0
#include "hydra_host.h"

#include "base/check.h"

#include <pxr/base/plug/registry.h>
#include <pxr/imaging/hd/camera.h>
#include <pxr/imaging/hd/rendererPluginRegistry.h>
#include <pxr/imaging/hd/tokens.h>
#include <pxr/usdImaging/usdImaging/stageSceneIndex.h>

#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

/// Runs one pass.
class PassTask final : public HdTask {
  public:
    PassTask(HdRenderPassSharedPtr pass, HdRenderPassStateSharedPtr state)
        : HdTask(SdfPath("/task")), pass_(std::move(pass)), state_(std::move(state)) {}

    void Sync(HdSceneDelegate*, HdTaskContext*, HdDirtyBits* dirty_bits) override {
        pass_->Sync();
        *dirty_bits = HdChangeTracker::Clean;
    }

    void Prepare(HdTaskContext*, HdRenderIndex*) override {}

    void Execute(HdTaskContext*) override { pass_->Execute(state_, GetRenderTags()); }

    const TfTokenVector& GetRenderTags() const override {
        static const TfTokenVector tags = {HdRenderTagTokens->geometry, HdRenderTagTokens->render};
        return tags;
    }

  private:
    HdRenderPassSharedPtr pass_;
    HdRenderPassStateSharedPtr state_;
};

void register_plugin() {
    static const bool is_registered = [] {
        PlugRegistry::GetInstance().RegisterPlugins(HYDRA_PLUGIN_RESOURCES);
        return true;
    }();
    (void)is_registered;
}

}  // namespace

Host::Host(UsdStageRefPtr stage,
           Frontend frontend,
           const SdfPath& camera,
           int width,
           int height,
           const HostSettings& settings,
           std::vector<std::string> aovs)
    : stage_(std::move(stage)),
      camera_(camera),
      width_(width),
      height_(height),
      aovs_(std::move(aovs)) {
    register_plugin();
    HdRenderSettingsMap map;
    map[HdRenderSettingsTokens->convergedSamplesPerPixel] = VtValue(settings.spp);
    const auto set = [&map](const char* name, const auto& value) {
        map[TfToken(std::string("velatura:") + name)] = VtValue(value);
    };
    set("seed", settings.seed);
    set("maxDepth", settings.max_depth);
    set("bounces", settings.bounces);
    set("caustics", settings.caustics);
    set("guiding", settings.guiding);
    set("splitting", settings.splits);
    set("adaptive", settings.adaptive);
    delegate_ = HdRendererPluginRegistry::GetInstance().CreateRenderDelegate(
        TfToken("HdVelaturaRendererPlugin"), map);
    VELATURA_CHECK(bool(delegate_), "the plugin hdVelatura is not found");
    index_.reset(HdRenderIndex::New(delegate_.Get(), {}));
    const SdfPath root = SdfPath::AbsoluteRootPath();
    if (frontend == Frontend::SceneDelegate) {
        imaging_ = std::make_unique<UsdImagingDelegate>(index_.get(), root);
        imaging_->SetDisplayRender(true);
        // As in files
        imaging_->SetWindowPolicy(CameraUtilFit);
        imaging_->Populate(stage_->GetPseudoRoot());
        imaging_->SetTime(UsdTimeCode(stage_->GetStartTimeCode()));
    } else {
        UsdImagingCreateSceneIndicesInfo info;
        info.stage = stage_;
        scene_indices_ = UsdImagingCreateSceneIndices(info);
        scene_indices_.stageSceneIndex->SetTime(UsdTimeCode(stage_->GetStartTimeCode()));
        index_->InsertSceneIndex(scene_indices_.finalSceneIndex, root);
    }
    for (const std::string& aov : aovs_) {
        auto* const buffer = static_cast<HdRenderBuffer*>(
            delegate_->CreateBprim(HdPrimTypeTokens->renderBuffer, SdfPath("/buffer")));
        buffer->Allocate(GfVec3i(width, height, 1),
                         delegate_->GetDefaultAovDescriptor(TfToken(aov)).format, false);
        buffers_.push_back(buffer);
    }
    state_ = delegate_->CreateRenderPassState();
    pass_ = delegate_->CreateRenderPass(
        index_.get(),
        HdRprimCollection(HdTokens->geometry, HdReprSelector(HdReprTokens->smoothHull)));
    tasks_ = {std::make_shared<PassTask>(pass_, state_)};
}

Host::~Host() {
    tasks_.clear();
    pass_.reset();
    for (HdRenderBuffer* const buffer : buffers_) delegate_->DestroyBprim(buffer);
    if (scene_indices_.finalSceneIndex) index_->RemoveSceneIndex(scene_indices_.finalSceneIndex);
    imaging_.reset();
    index_.reset();
}

void Host::step() {
    if (imaging_) imaging_->ApplyPendingUpdates();
    if (scene_indices_.stageSceneIndex) scene_indices_.stageSceneIndex->ApplyPendingUpdates();
    // The first sync makes the camera
    for (int pass = 0; pass < 2; ++pass) {
        const auto* const camera =
            static_cast<const HdCamera*>(index_->GetSprim(HdPrimTypeTokens->camera, camera_));
        state_->SetCamera(camera);
        const GfRect2i window(GfVec2i(0, 0), width_, height_);
        state_->SetFraming(CameraUtilFraming(
            GfRange2f(GfVec2f(0.0f), GfVec2f(float(width_), float(height_))), window, 1.0f));
        HdRenderPassAovBindingVector bindings;
        for (size_t i = 0; i < aovs_.size(); ++i) {
            HdRenderPassAovBinding binding;
            binding.aovName = TfToken(aovs_[i]);
            binding.renderBuffer = buffers_[i];
            bindings.push_back(binding);
        }
        state_->SetAovBindings(bindings);
        engine_.Execute(index_.get(), &tasks_);
        if (camera) break;
    }
}

void Host::finish() {
    step();
    while (!pass_->IsConverged()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        step();
    }
}

AovImage Host::read(const std::string& aov) {
    AovImage image;
    for (size_t i = 0; i < aovs_.size(); ++i) {
        if (aovs_[i] != aov) continue;
        HdRenderBuffer& buffer = *buffers_[i];
        buffer.Resolve();
        image.width = int(buffer.GetWidth());
        image.height = int(buffer.GetHeight());
        image.components = HdGetComponentCount(buffer.GetFormat());
        const size_t row = size_t(image.width) * image.components;
        const bool is_int = HdGetComponentFormat(buffer.GetFormat()) == HdFormatInt32;
        const void* const pixels = buffer.Map();
        for (int y = image.height - 1; y >= 0; --y) {
            const size_t begin = size_t(y) * row;
            if (is_int)
                image.ints.insert(image.ints.end(), static_cast<const int32_t*>(pixels) + begin,
                                  static_cast<const int32_t*>(pixels) + begin + row);
            else
                image.floats.insert(image.floats.end(), static_cast<const float*>(pixels) + begin,
                                    static_cast<const float*>(pixels) + begin + row);
        }
        buffer.Unmap();
    }
    return image;
}

}  // namespace velatura::hydra
