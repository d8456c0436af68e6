// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/render_delegate.h"

#include "base/process/memory_limit.h"
#include "plugins/hydra/camera_prim.h"
#include "plugins/hydra/geometry_prim.h"
#include "plugins/hydra/render_pass.h"
#include "plugins/hydra/scene_prims.h"

#include <pxr/imaging/hd/bprim.h>
#include <pxr/imaging/hd/instancer.h>
#include <pxr/imaging/hd/rprim.h>
#include <pxr/imaging/hd/sprim.h>
#include <pxr/imaging/hd/tokens.h>

#include <algorithm>

namespace velatura::hydra {

using namespace PXR_NS;

namespace {

const TfToken& openvdb_asset() {
    static const TfToken token("openvdbAsset");
    return token;
}

bool is_light(const TfToken& type) {
    const TfTokenVector& types = light_types();
    return std::find(types.begin(), types.end(), type) != types.end();
}

}  // namespace

RenderDelegate::RenderDelegate(const HdRenderSettingsMap& settings)
    : HdRenderDelegate(settings),
      resources_(std::make_shared<HdResourceRegistry>()),
      loop_(records_) {
    _PopulateDefaultSettings(setting_descriptors());
}

const TfTokenVector& RenderDelegate::GetSupportedRprimTypes() const {
    return geometry_types();
}

const TfTokenVector& RenderDelegate::GetSupportedSprimTypes() const {
    static const TfTokenVector types = [] {
        TfTokenVector all = light_types();
        all.push_back(HdPrimTypeTokens->camera);
        all.push_back(HdPrimTypeTokens->material);
        return all;
    }();
    return types;
}

const TfTokenVector& RenderDelegate::GetSupportedBprimTypes() const {
    static const TfTokenVector types = {HdPrimTypeTokens->renderBuffer, openvdb_asset()};
    return types;
}

HdRprim* RenderDelegate::CreateRprim(const TfToken& type, const SdfPath& id) {
    return new GeometryPrim(type, id, records_);
}

HdSprim* RenderDelegate::CreateSprim(const TfToken& type, const SdfPath& id) {
    if (type == HdPrimTypeTokens->camera) return new CameraPrim(id);
    if (type == HdPrimTypeTokens->material) return new MaterialPrim(id, records_);
    if (is_light(type)) return new LightPrim(type, id, records_);
    return nullptr;
}

HdSprim* RenderDelegate::CreateFallbackSprim(const TfToken& type) {
    return CreateSprim(type, SdfPath::EmptyPath());
}

HdBprim* RenderDelegate::CreateBprim(const TfToken& type, const SdfPath& id) {
    if (type == HdPrimTypeTokens->renderBuffer)
        return new RenderBuffer(id, [this](const RenderBuffer& buffer) { loop_.detach(buffer); });
    if (type == openvdb_asset()) return new FieldPrim(id, records_);
    return nullptr;
}

HdBprim* RenderDelegate::CreateFallbackBprim(const TfToken& type) {
    return CreateBprim(type, SdfPath::EmptyPath());
}

HdInstancer* RenderDelegate::CreateInstancer(HdSceneDelegate* delegate, const SdfPath& id) {
    return new InstancerPrim(delegate, id, records_);
}

void RenderDelegate::DestroyRprim(HdRprim* prim) {
    delete prim;
}

void RenderDelegate::DestroySprim(HdSprim* prim) {
    delete prim;
}

void RenderDelegate::DestroyBprim(HdBprim* prim) {
    delete prim;
}

void RenderDelegate::DestroyInstancer(HdInstancer* instancer) {
    delete instancer;
}

HdRenderPassSharedPtr RenderDelegate::CreateRenderPass(HdRenderIndex* index,
                                                       const HdRprimCollection& collection) {
    return std::make_shared<RenderPass>(index, collection, records_, loop_);
}

bool RenderDelegate::Pause() {
    loop_.pause(true);
    return true;
}

bool RenderDelegate::Resume() {
    loop_.pause(false);
    return true;
}

bool RenderDelegate::Stop(bool is_blocking) {
    // A job that is stopped writes nothing any more: there is nothing to wait for
    (void)is_blocking;
    loop_.stop();
    return true;
}

bool RenderDelegate::Restart() {
    loop_.restart();
    return true;
}

VtDictionary RenderDelegate::GetRenderStats() const {
    const LoopStatus status = loop_.status();
    VtDictionary stats;
    stats["rendererName"] = VtValue(std::string("Velatura"));
    stats["percentDone"] = VtValue(100.0 * status.fraction);
    stats["fractionDone"] = VtValue(status.fraction);
    stats["totalClockTime"] = VtValue(status.load_s + status.render_s);
    stats["loadClockTime"] = VtValue(status.load_s);
    stats["renderProgressAnnotation"] = VtValue(status.activity);
    stats["velatura:lastUpdate"] = VtValue(status.last_update);
    stats[HdPerfTokens->numCompletedSamples.GetString()] = VtValue(int(status.samples));
    stats["peakMemory"] = VtValue(double(peak_resident_bytes()));
    return stats;
}

HdRenderSettingDescriptorList RenderDelegate::GetRenderSettingDescriptors() const {
    return setting_descriptors();
}

TfTokenVector RenderDelegate::GetRenderSettingsNamespaces() const {
    return {TfToken("velatura")};
}

HdAovDescriptor RenderDelegate::GetDefaultAovDescriptor(const TfToken& name) const {
    return default_descriptor(name);
}

TfToken RenderDelegate::GetMaterialBindingPurpose() const {
    return HdTokens->full;
}

TfTokenVector RenderDelegate::GetMaterialRenderContexts() const {
    return {TfToken("velatura"), TfToken("mtlx"), TfToken("")};
}

}  // namespace velatura::hydra
