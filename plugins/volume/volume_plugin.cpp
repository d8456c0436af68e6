// SPDX-License-Identifier: Apache-2.0
#include "media/volume_source.h"
#include "plugin/plugin_api.h"
#include "plugins/volume/vdb_source.h"

namespace {

using namespace velatura;

const plugins::volume::VdbSource source;
const plugin::InterfaceEntry interfaces[] = {{media::volume_source_interface,
                                              media::volume_source_interface_version,
                                              static_cast<const media::VolumeSource*>(&source)}};
const plugin::PluginInfo info = {plugin::abi_version, "volume", interfaces, 1};

}  // namespace

extern "C" [[gnu::visibility("default")]] const velatura::plugin::PluginInfo* velatura_plugin_v1();

const velatura::plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
