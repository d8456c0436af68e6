// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/linking_plugin.h"

#include <pxr/imaging/hd/sceneIndexPluginRegistry.h>
#include <pxr/imaging/hdsi/lightLinkingSceneIndex.h>

PXR_NAMESPACE_OPEN_SCOPE

TF_REGISTRY_FUNCTION(TfType) {
    HdSceneIndexPluginRegistry::Define<HdVelatura_LightLinkingSceneIndexPlugin>();
}

TF_REGISTRY_FUNCTION(HdSceneIndexPlugin) {
    HdSceneIndexPluginRegistry::GetInstance().RegisterSceneIndexForRenderer(
        "Velatura", TfToken("HdVelatura_LightLinkingSceneIndexPlugin"), nullptr, 0,
        HdSceneIndexPluginRegistry::InsertionOrderAtStart);
}

HdSceneIndexBaseRefPtr HdVelatura_LightLinkingSceneIndexPlugin::_AppendSceneIndex(
    const HdSceneIndexBaseRefPtr& scene, const HdContainerDataSourceHandle& args) {
    return HdsiLightLinkingSceneIndex::New(scene, args);
}

PXR_NAMESPACE_CLOSE_SCOPE
