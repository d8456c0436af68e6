// SPDX-License-Identifier: Apache-2.0
#include "built_plugin.h"

#include "plugin/registry.h"

namespace velatura::fuzz {

const void* built_interface(const char* interface_name,
                            uint32_t version,
                            const char* trigger_kind,
                            const char* trigger_value) {
    Diagnostics diagnostics;
    const plugin::Registry registry({{VELATURA_BUILT_PLUGINS}}, diagnostics);
    const plugin::Manifest* manifest = registry.find(interface_name, {trigger_kind, trigger_value});
    return manifest == nullptr
               ? nullptr
               : plugin::open_interface(*manifest, interface_name, version, diagnostics);
}

}  // namespace velatura::fuzz
