// SPDX-License-Identifier: Apache-2.0
#include "accel/accelerator_factory.h"
#include "plugin/plugin_api.h"
#include "plugins/embree/embree_accelerator.h"

namespace {

using namespace velatura;

const plugins::embree::EmbreeFactory factory;
const plugin::InterfaceEntry interfaces[] = {
    {accel::accelerator_interface, accel::accelerator_interface_version,
     static_cast<const accel::AcceleratorFactory*>(&factory)}};
const plugin::PluginInfo info = {plugin::abi_version, "embree", interfaces, 1};

}  // namespace

extern "C" [[gnu::visibility("default")]] const velatura::plugin::PluginInfo* velatura_plugin_v1();

const velatura::plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
