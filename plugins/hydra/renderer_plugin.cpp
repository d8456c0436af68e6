// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/renderer_plugin.h"

#include "plugins/hydra/render_delegate.h"

#include <dlfcn.h>
#include <pxr/imaging/hd/rendererPluginRegistry.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace velatura::hydra {

/// Velatura's plugins lie beside this library, wherever the program of the host is. A search path
/// that is set already counts instead.
static void find_plugins() {
    static const char here = 0;
    Dl_info info;
    if (dladdr(&here, &info) == 0 || !info.dli_fname) return;
    const std::filesystem::path folder = std::filesystem::path(info.dli_fname).parent_path();
    std::error_code failed;
    for (const auto& plugins : {folder / "plugins", folder.parent_path() / "plugins"})
        if (std::filesystem::is_directory(plugins, failed))
            setenv("VELATURA_PLUGIN_PATH", plugins.c_str(), 0);
}

}  // namespace velatura::hydra

PXR_NAMESPACE_OPEN_SCOPE

TF_REGISTRY_FUNCTION(TfType) {
    HdRendererPluginRegistry::Define<HdVelaturaRendererPlugin>();
}

HdRenderDelegate* HdVelaturaRendererPlugin::CreateRenderDelegate() {
    return CreateRenderDelegate(HdRenderSettingsMap());
}

HdRenderDelegate* HdVelaturaRendererPlugin::CreateRenderDelegate(
    const HdRenderSettingsMap& settings) {
    velatura::hydra::find_plugins();
    return new velatura::hydra::RenderDelegate(settings);
}

void HdVelaturaRendererPlugin::DeleteRenderDelegate(HdRenderDelegate* delegate) {
    delete delegate;
}

bool HdVelaturaRendererPlugin::IsSupported(bool has_gpu) const {
    (void)has_gpu;
    return true;
}

PXR_NAMESPACE_CLOSE_SCOPE
