// SPDX-License-Identifier: Apache-2.0
#include "geometry/subdivider.h"
#include "plugin/plugin_api.h"
#include "plugins/subdivision/bfr_surface.h"

namespace {

using namespace velatura;

const plugins::subdivision::OpenSubdivSubdivider subdivider;
const plugin::InterfaceEntry interfaces[] = {
    {geometry::subdivider_interface, geometry::subdivider_interface_version,
     static_cast<const geometry::Subdivider*>(&subdivider)}};
const plugin::PluginInfo info = {plugin::abi_version, "subdivision", interfaces, 1};

}  // namespace

extern "C" [[gnu::visibility("default")]] const velatura::plugin::PluginInfo* velatura_plugin_v1();

const velatura::plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
